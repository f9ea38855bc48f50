"""The one error that a caller sees."""

from pathlib import Path


class TrialsError(Exception):
    """Why an import stopped: the file, the field in it, what is wrong and the way out."""

    def __init__(self, path: Path | str, field: str, message: str) -> None:
        self.path, self.field, self.message = Path(path), field, message
        where = f"{path}: {field}" if field else str(path)
        super().__init__(f"{where}: {message}")
