"""The README's ten lines work with every client, and print what the server says, in the form that it shows.

So do the lines of Python in the README of the repository.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from readme import IN_PROCESS, SERVED, printed, ten_lines
from servers import Server
from test_values import query

NUMBER = re.compile(r"-?\d+\.?\d*")


def form(text: str) -> list[str]:
    """The text without what depends on the weights: numbers, the blanks that align them, and yes or no."""
    return [re.sub(r"\s+|True|False", "", NUMBER.sub("#", line)) for line in text.splitlines()]


def test_the_ten_lines(server: Server) -> None:
    code, shown = ten_lines(SERVED)
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    expected = query("husky", ["--speed=0.8", "--depth=0.18"])
    for client in (
        f'GrpcClient("{server.address}"',
        f'GrpcClient("unix:{server.socket}"',
        f'ShmClient("{server.namespace}"',
    ):
        text = printed(code, SERVED, client)
        assert form(text) == form(shown), "the README shows another form: run clients/python/tests/readme.py"
        numbers = [float(number) for number in NUMBER.findall(text)]
        np.testing.assert_allclose(numbers[:3], expected["wrench"]["force"], atol=0.051)
        np.testing.assert_allclose(numbers[3:6], expected["wrench"]["moment"], atol=0.051)
        assert numbers[6:] == [1024, 3]
        assert str(expected["in_domain"]) in text


def test_the_ten_lines_in_process(server: Server) -> None:
    code, shown = ten_lines(IN_PROCESS)
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    text = printed(code, IN_PROCESS, f'InProcess("{server.vehicles}"')
    assert form(text) == form(shown), "the README shows another form: run clients/python/tests/readme.py"
    served, _ = ten_lines(SERVED)
    assert text == printed(served, SERVED, f'GrpcClient("{server.address}"')


def test_the_lines_of_the_repositorys_readme(server: Server) -> None:
    readme = (Path(__file__).resolve().parents[3] / "README.md").read_text()
    code = readme.split("```python\n")[1].split("```")[0]
    text = printed(code, SERVED, f'GrpcClient("{server.address}"')
    expected = query("husky", ["--speed=0.8", "--depth=0.18"])
    numbers = [float(number) for number in NUMBER.findall(text)]
    np.testing.assert_allclose(numbers, expected["wrench"]["force"], atol=0.051)
