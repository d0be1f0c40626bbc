"""Files, workers and plug-ins: the base of all packages, independent of curling."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "files.kinds": ("FILM_SUFFIXES", "kind_of"),
        "files.schema": ("Document", "FileFormat", "checked", "within"),
        "files.reading": (
            "confined",
            "ordinary_file",
            "read_arrays",
            "read_bytes",
            "read_json",
            "read_text",
            "read_yaml",
        ),
        "files.storage": ("format_json", "write_arrays", "write_json", "write_table", "write_text"),
        "files.table": ("Column", "read_table"),
        "files.writing": (
            "at_once",
            "atomic_path",
            "check_writable",
            "command_files",
            "fitted",
            "folder_of_drafts",
            "make_directory",
            "note_input",
            "together",
            "current_path",
        ),
        "local_server": ("LocalHandler", "LocalServer"),
        "plugins": ("shadowed_by",),
        "provenance": ("typed",),
        "web_server": ("Certificate", "listening", "serving"),
        "workers": ("ProcessExecutor", "WorkersLostError"),
    },
)
