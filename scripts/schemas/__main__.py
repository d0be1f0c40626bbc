"""Write docs/schemas anew: `cd scripts && python -m schemas`."""

from pathlib import Path

from schemas.catalogue import FILES, page

FOLDER = Path(__file__).parents[2] / "docs" / "schemas"


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for file in FILES:
        (FOLDER / file.file_name).write_text(file.text(), encoding="utf-8")
    (FOLDER / "README.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
