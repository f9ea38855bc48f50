"""What the README's ten lines print, and how it gets there: after new weights,

    python clients/python/tests/readme.py

runs them against a server with the shipped vehicles and writes what they print below them.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from servers import Server

README = Path(__file__).resolve().parents[1] / "README.md"
_LINES = re.compile(r"(```python\n)(.*?)(```\n\n```\n)(.*?)(```)", re.DOTALL)
#: Where the README's lines look for the server.
_AT = 'GrpcClient("127.0.0.1:50051"'


def ten_lines() -> tuple[str, str]:
    """The code, and what the README says it prints."""
    match = _LINES.search(README.read_text())
    assert match, "the README has a block of Python with what it prints below"
    return match.group(2), match.group(4)


def printed(code: str, client: str) -> str:
    """What the lines print with a client opened otherwise, such as `ShmClient("name"`."""
    assert code.count(_AT) == 1, f"the README's lines open {_AT})"
    command = [sys.executable, "-c", code.replace(_AT, client)]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout


def main() -> None:
    """Writes the README anew."""
    with tempfile.TemporaryDirectory() as folder:
        server = Server(Path(folder))
        server.start()
        try:
            shown = printed(ten_lines()[0], f'GrpcClient("{server.address}"')
        finally:
            server.stop()
    text = README.read_text()
    README.write_text(_LINES.sub(lambda match: "".join((*match.group(1, 2, 3), shown, match.group(5))), text, count=1))


if __name__ == "__main__":
    main()
