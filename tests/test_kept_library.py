"""A library that was built is found again for the same sources, and for these only."""

import hashlib
import json
import os
import subprocess

import pytest

from hsv import kept_library


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Return where the index of the library is to be, of a package with one source."""
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "source.py").write_text("a = 1\n")
    monkeypatch.setattr(kept_library, "PACKAGE", tmp_path / "package")
    monkeypatch.setattr("hsv.precompiled.PACKAGE", tmp_path / "package")
    monkeypatch.setattr(kept_library, "INDEX", tmp_path / "installed" / "ahead_of_time.json")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return kept_library.INDEX


def install(folder, number=1):
    """Install a library with a function that returns the ``number``; return what is then there."""
    source, built = folder / "library.c", folder / "built"
    source.write_text(f"int number(void) {{ return {number}; }}\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", built, source], check=True)
    library = built.read_bytes()
    contents = hashlib.sha256(library).hexdigest()
    kept_library.install({"library": f"ahead_of_time.{contents[:16]}.so", "contents": contents}, library)
    return installed()


def installed():
    return {path.name: path.read_bytes() for path in kept_library.INDEX.parent.iterdir()}


def remove():
    for path in kept_library.INDEX.parent.iterdir():
        path.unlink()


def test_a_library_that_was_kept_is_installed_again(place, tmp_path):
    assert not kept_library.restored()
    before = install(tmp_path)
    kept_library.keep()
    remove()
    assert kept_library.restored()
    assert installed() == before and len(before) == 2


def test_the_library_that_is_there_gives_way(place, tmp_path):
    before = install(tmp_path)
    kept_library.keep()
    assert install(tmp_path, 2) != before
    assert kept_library.restored()
    assert installed() == before


@pytest.mark.parametrize("change", ["content", "another module", "name", "processor", "numba"])
def test_a_library_of_other_sources_or_for_another_machine_is_not_installed(place, tmp_path, monkeypatch, change):
    install(tmp_path)
    kept_library.keep()
    remove()
    source = tmp_path / "package" / "source.py"
    if change == "content":
        source.write_text("a = 2\n")
    elif change == "another module":
        (tmp_path / "package" / "more").mkdir()
        (tmp_path / "package" / "more" / "other.py").touch()
    elif change == "name":
        source.rename(source.with_name("other.py"))
    elif change == "processor":
        monkeypatch.setattr(kept_library, "processor", lambda: "another")
    else:
        monkeypatch.setattr(kept_library, "version", lambda name: "0.1")
    assert not kept_library.restored() and not installed()


def test_byte_code_is_no_source(place, tmp_path):
    install(tmp_path)
    kept_library.keep()
    cache = tmp_path / "package" / "__pycache__"
    cache.mkdir()
    (cache / "source.pyc").touch()
    assert kept_library.restored()


@pytest.mark.parametrize("damage", ["library cut", "library gone", "index cut", "no index", "other contents"])
def test_a_damaged_one_is_not_installed(place, tmp_path, damage):
    install(tmp_path)
    kept_library.keep()
    remove()
    [library], [index] = (list((tmp_path / "cache").rglob(f"*.{kind}")) for kind in ("so", "json"))
    if damage == "library cut":
        os.truncate(library, 100)
    elif damage == "library gone":
        library.unlink()
    elif damage == "index cut":
        os.truncate(index, 10)
    elif damage == "no index":
        index.write_text("[]")
    else:
        # All as it should be, except that the file is no library.
        other, contents = b"no library", hashlib.sha256(b"no library").hexdigest()
        library.with_name("other.so").write_bytes(other)
        index.write_text(json.dumps({"library": "other.so", "contents": contents}))
    assert not kept_library.restored() and not installed()


def test_where_there_is_no_place_nothing_is_kept(place, tmp_path, monkeypatch):
    install(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc")
    kept_library.keep()
    assert not kept_library.restored()


def test_the_last_libraries_are_kept(place, tmp_path):
    source = tmp_path / "package" / "source.py"
    for number in range(kept_library._MOST_KEPT):
        source.write_text(f"a = {number}\n")
        install(tmp_path, number)
        kept_library.keep()
    source.write_text("a = 0\n")
    assert kept_library.restored()  # which makes it the one that was used last
    source.write_text("a = -1\n")
    kept_library.keep()
    kept = []
    for number in range(-1, kept_library._MOST_KEPT):
        source.write_text(f"a = {number}\n")
        if kept_library.restored():
            kept.append(number)
    assert kept == [-1, 0, *range(2, kept_library._MOST_KEPT)]
