"""The examples in the documentation run, and every part of the native module has its documentation."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import palpate
import pytest
from palpate import _native

README = Path(__file__).parents[3] / "README.md"


def documented(prefix: str, holder: object) -> Iterator[tuple[str, str]]:
    """The names and documentation of what a module or class holds."""
    for name, member in vars(holder).items():
        if name.startswith("_"):
            continue
        inside = member.__func__ if isinstance(member, staticmethod) else member
        yield f"{prefix}.{name}", inspect.getdoc(inside) or ""
        if inspect.isclass(member):
            yield from documented(f"{prefix}.{name}", member)


NATIVE = dict(documented("palpate._native", _native))


def test_everything_native_is_documented() -> None:
    assert [name for name, text in NATIVE.items() if not text] == []
    assert len(NATIVE) > 50


def run(name: str, text: str) -> int:
    test = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    runner.run(test)
    assert runner.summarize(verbose=False).failed == 0, name
    return len(test.examples)


EXAMPLES = {name: text for name, text in NATIVE.items() if ">>>" in text}


def test_the_native_module_has_its_examples() -> None:
    # pytest finds none of them by itself: a number that falls is an example that nobody runs.
    assert len(EXAMPLES) == 11, sorted(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_native_example(name: str) -> None:
    assert run(name, EXAMPLES[name]) >= 3


@pytest.mark.parametrize("name", ["palpate", "palpate._evaluate", "palpate._import"])
def test_python_examples(name: str) -> None:
    finder = doctest.DocTestFinder(exclude_empty=True)
    tests = [test for test in finder.find(importlib.import_module(name), name) if test.examples]
    assert tests
    for test in tests:
        runner = doctest.DocTestRunner()
        runner.run(test)
        assert runner.summarize(verbose=False).failed == 0


def test_what_is_exported_exists() -> None:
    assert sorted(palpate.__all__) == palpate.__all__
    for name in palpate.__all__:
        getattr(palpate, name)


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_the_readme_goes_from_python_to_c_as_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```(python|c)\n(.*?)^```", README.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert [language for language, _ in blocks] == ["python", "c", "python", "c"]

    def built(program: str, text: str) -> str:
        (tmp_path / f"{program}.c").write_text(text)
        subprocess.run(["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", f"{program}.c", "-o", program], check=True)
        return f"./{program}"

    def printed(program: str, rows: str = "") -> int:
        return int(subprocess.run([program], input=rows, check=True, capture_output=True, text=True).stdout)

    wine, digits = dict[str, Any](), dict[str, Any]()
    exec(blocks[0][1], wine)
    assert printed(built("wine", blocks[1][1])) == wine["classifier"].predict(wine["rows"][:1])[0]
    exec(blocks[2][1], digits)
    program, rows = built("digits", blocks[3][1]), digits["images"][-40:].reshape(-1, 8)
    expected = digits["recognizer"].predict(rows, sequence=[row // 8 for row in range(len(rows))])
    for image, name in zip(rows.reshape(40, 64), expected, strict=True):
        assert printed(program, " ".join(map(str, image))) == (-1 if name is None else name)
    assert sum(name is not None for name in expected) > 20
