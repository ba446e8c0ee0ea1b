"""What is checked in fits together: stubs, the blocking client, types, docstrings, the version, the wheel."""

from __future__ import annotations

import filecmp
import importlib
import inspect
import pathlib
import pkgutil
import re
import subprocess
import sys
import zipfile

import pytest
import relmap
from conftest import PYTHON, SOURCE, needed, program


def test_stubs_are_those_of_protoc(tmp_path: pathlib.Path) -> None:
    subprocess.run([PYTHON / "update_stubs", tmp_path], check=True)
    made = sorted(path.name for path in (tmp_path / "relmap/v1").iterdir())
    there = sorted(p.name for p in (PYTHON / "relmap/v1").iterdir() if "_pb2" in p.name)
    assert made == there, "run client/python/update_stubs, and add or remove files"
    _, differ, failed = filecmp.cmpfiles(tmp_path / "relmap/v1", PYTHON / "relmap/v1", made, shallow=False)
    assert not differ and not failed, "run client/python/update_stubs"


def test_the_blocking_client_is_made_of_the_other() -> None:
    subprocess.run([sys.executable, PYTHON / "make_sync", "--check"], check=True)


def test_types_are_strict(tmp_path: pathlib.Path) -> None:
    needed("mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", "pyproject.toml", "--cache-dir", str(tmp_path)]
    for more in ([], ["tests/typed_program.py"]):
        result = subprocess.run(command + more, cwd=PYTHON, capture_output=True, text=True)
        assert result.returncode == 0, result.stdout


def _modules() -> list[str]:
    names = [m.name for m in pkgutil.walk_packages(relmap.__path__, "relmap.")]
    return ["relmap"] + [name for name in names if not name.startswith("relmap.v1.")]


@pytest.mark.parametrize("name", _modules())
def test_every_public_name_has_a_docstring(name: str) -> None:
    module = importlib.import_module(name)
    assert module.__doc__, name
    missing = []
    for key, value in vars(module).items():
        if key.startswith("_") or getattr(value, "__module__", None) != name:
            continue
        if not (inspect.isfunction(value) or inspect.isclass(value)):
            continue
        if not value.__doc__ or value.__doc__.startswith(f"{key}("):  # the latter is a dataclass's own
            missing.append(key)
        if inspect.isclass(value):
            for attribute, member in vars(value).items():
                function = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
                if not attribute.startswith("_") and inspect.isfunction(function) and not function.__doc__:
                    if not function.__name__.startswith(("_", "<")):  # a table's row, which is described as its attribute
                        missing.append(f"{key}.{attribute}")
    assert not missing


def test_every_field_of_a_record_is_described() -> None:
    missing = []
    for name in _modules():
        for key, value in vars(importlib.import_module(name)).items():
            if not inspect.isclass(value) or value.__module__ != name or key.startswith("_"):
                continue
            fields = getattr(value, "__dataclass_fields__", {})
            own = [f for f in fields if not f.startswith("_") and f in value.__annotations__]
            text = value.__doc__ or ""
            missing += [f"{name}.{key}.{f}" for f in own if len(own) > 2 and not re.search(rf"\b{f}\b", text)]
    assert not missing


def test_the_version_is_that_of_the_project() -> None:
    declared = re.search(r"project\(relmap VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text())
    assert declared is not None and relmap.__version__ == declared[1]
    assert relmap.__version__ in program("relmapd", "--version").stdout


def test_a_wheel_is_built_and_works(tmp_path: pathlib.Path) -> None:
    needed("build")
    needed("wheel")
    copy = tmp_path / "source"
    ignored = ["--exclude=__pycache__", "--exclude=build", "--exclude=*.egg-info"]
    copy.mkdir()
    tar = subprocess.run(["tar", "-c", *ignored, "-C", PYTHON, "."], check=True, capture_output=True)
    subprocess.run(["tar", "-x", "-C", copy], input=tar.stdout, check=True)
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path), str(copy)]
    subprocess.run(command, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name == f"relmap-{relmap.__version__}-py3-none-any.whl"
    names = set(zipfile.ZipFile(wheel).namelist())
    wanted = {str(p.relative_to(PYTHON)) for p in (PYTHON / "relmap").rglob("*") if p.suffix in (".py", ".pyi", ".typed")}
    assert wanted <= names and not any("tests" in name for name in names)
    code = "import relmap, sys; assert sys.path[0] in relmap.__file__; print(relmap.__version__)"
    path = f"import sys; sys.path.insert(0, {str(wheel)!r}); "
    done = subprocess.run([sys.executable, "-I", "-c", path + code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == relmap.__version__


def test_a_tool_that_is_missing_is_not_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RELMAP_TESTS_WITHOUT_TOOLS", raising=False)
    assert needed("json").__name__ == "json"
    with pytest.raises(ModuleNotFoundError):
        needed("no_such_tool")
    monkeypatch.setenv("RELMAP_TESTS_WITHOUT_TOOLS", "1")
    with pytest.raises(pytest.skip.Exception):
        needed("no_such_tool")
