"""The program that the tests run: $WADE, $WADE_BIN or what cargo built."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


def _program() -> str:
    built = ROOT / "target" / "debug" / "wade"
    return os.environ.get("WADE") or os.environ.get("WADE_BIN") or str(built)


os.environ["WADE"] = _program()


@pytest.fixture(scope="session")
def wade() -> str:
    """The program; the tests fail without one."""
    program = os.environ["WADE"]
    assert Path(program).exists(), f"{program} is missing: cargo build, or set WADE"
    return program
