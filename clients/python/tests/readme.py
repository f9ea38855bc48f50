"""What the README's blocks of ten lines print, and how it gets there: after new weights,

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
#: What the README's lines open, at a server and in process.
SERVED = 'GrpcClient("127.0.0.1:50051"'
IN_PROCESS = "InProcess("


def ten_lines(opened: str) -> tuple[str, str]:
    """The code that opens such a client, and what the README says it prints."""
    found = [(code, shown) for _, code, _, shown, _ in _LINES.findall(README.read_text()) if opened in code]
    assert len(found) == 1, f"the README has one block that opens {opened}) with what it prints below"
    return found[0]


def printed(code: str, opened: str, client: str) -> str:
    """What the lines print with a client opened otherwise, such as `ShmClient("name"`."""
    assert code.count(opened) == 1, f"the README's lines open {opened})"
    command = [sys.executable, "-c", code.replace(opened, client)]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout


def main() -> None:
    """Writes what the lines print into the README."""
    with tempfile.TemporaryDirectory() as folder:
        server = Server(Path(folder))
        server.start()
        try:
            clients = {SERVED: f'GrpcClient("{server.address}"', IN_PROCESS: f'InProcess("{server.vehicles}"'}
            shown = {opened: printed(ten_lines(opened)[0], opened, client) for opened, client in clients.items()}
        finally:
            server.stop()
    text = README.read_text()
    for opened, lines in shown.items():
        code, before = ten_lines(opened)
        text = text.replace(f"{code}```\n\n```\n{before}", f"{code}```\n\n```\n{lines}")
    README.write_text(text)


if __name__ == "__main__":
    main()
