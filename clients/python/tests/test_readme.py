"""The README's ten lines work and print what it shows."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from servers import Server

README = (Path(__file__).resolve().parents[1] / "README.md").read_text()


def test_the_ten_lines(server: Server) -> None:
    match = re.search(r"```python\n(.*?)```\n\n```\n(.*?)```", README, re.DOTALL)
    assert match
    code, shown = match.groups()
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    for at in (
        f'GrpcClient("{server.address}"',
        f'GrpcClient("unix:{server.socket}"',
        f'ShmClient("{server.namespace}"',
    ):
        program = code.replace('GrpcClient("127.0.0.1:50051"', at)
        run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=30)
        assert run.stdout == shown, "the README shows the numbers of other weights"
