"""Environments of make test-portability: what cannot be had is said."""

import pytest

import portability
from portability import Environment, MissingError, prepare


@pytest.fixture
def bare_machine(tmp_path, monkeypatch):
    """No programs, nothing prepared."""
    monkeypatch.setattr(portability, "CACHE", tmp_path / "cache")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))


@pytest.mark.parametrize("name", ["nehalem", "aarch64"])
def test_without_emulator_and_archive_a_line_says_so(bare_machine, name):
    with pytest.raises(MissingError, match=r"^no .* expected a system with apt-get and dpkg$"):
        prepare(name)
    assert Environment.read(name) is None


def test_without_python_312_a_line_says_so(bare_machine, monkeypatch):
    # Were it this one, it would be found.
    monkeypatch.setattr("sys.executable", "/nonexistent/python3")
    with pytest.raises(MissingError, match=r"^no Python 3\.12 on the PATH"):
        prepare("numpy-1.26")
