"""Files, workers and plug-ins: what all packages stand on, and what knows nothing of curling."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "executor": ("ProcessExecutor", "WorkersLostError"),
        "files.kinds": ("FILM_SUFFIXES", "kind_of"),
        "files.schema": ("Document", "FileFormat", "checked", "within"),
        "files.storage": (
            "Column",
            "at_once",
            "atomic_path",
            "check_writable",
            "confined",
            "folder_of_drafts",
            "format_json",
            "make_directory",
            "ordinary_file",
            "read_arrays",
            "read_bytes",
            "read_json",
            "read_table",
            "read_text",
            "read_yaml",
            "together",
            "write_arrays",
            "write_json",
            "write_table",
            "write_text",
            "written_so_far",
        ),
        "files.writing": ("command_files", "fitted", "note_input"),
        "local_server": ("LocalHandler", "LocalServer"),
        "plugins": ("what_hides",),
        "provenance": ("typed",),
        "web_server": ("Certificate", "serving"),
    },
)
