"""Promise: a million rows take well under a minute, with bounded memory, and progress is shown."""

import os
import subprocess
import sys
from pathlib import Path

import generated
import numpy as np
import pytest
from helpers import mapping_of

from wade_trials.cli import Progress
from wade_trials.write import mapping_text

ROWS = 1_000_000


def test_a_million_rows(tmp_path: Path) -> None:
    recording = generated.record(seconds=ROWS / 120, noise=3e-4)
    file = tmp_path / "run.csv"
    columns = generated.table(recording)
    with file.open("w") as out:
        out.write(",".join(columns) + "\n")
        table = np.stack(list(columns.values()), axis=1)
        row = ",".join(["%.7f"] * len(columns)) + "\n"
        for start in range(0, ROWS, 20_000):
            part = table[start : start + 20_000]
            out.write((row * len(part)) % tuple(part.ravel().tolist()))
    del table, columns, recording
    path = tmp_path / "mapping.toml"
    path.write_text(mapping_text(mapping_of(file), tmp_path))
    command = [sys.executable, "-m", "wade_trials", "import", str(path), "--out", str(tmp_path / "out")]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    _, status, used = os.wait4(process.pid, 0)
    # the time of the processor: other programs run beside the tests
    seconds, megabytes = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    assert status == 0
    with (tmp_path / "out" / "run.csv").open() as rows:
        assert abs(sum(1 for _ in rows) - ROWS / 120 * 111) < 300
    assert seconds < 40 and megabytes < 1000, (seconds, megabytes)


def test_progress_is_shown_on_a_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    progress = Progress()
    progress.last -= 1.0
    progress.report("run: reading", 0.5)
    progress.report("run: reading", 0.6)
    progress.clear()
    assert capsys.readouterr().err.count("run: reading  50%") == 1
