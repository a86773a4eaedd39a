"""A library that was built is found again for the same sources, and for these only."""

import hashlib
import json
import os
import subprocess
import time
from pathlib import Path

import pytest
from full_disk import files_no_larger_than

from hsv import kept_library

SOURCE = "elementary.py"
"""A source that the library may have been compiled from."""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Return where the index of the library is to be."""
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
    index = {"library": f"ahead_of_time.{contents[:16]}.so", "contents": contents}
    index |= {"sources": [SOURCE], "digest": kept_library.digest([SOURCE])}
    kept_library.install(index, library)
    return installed()


def installed():
    return {path.name: path.read_bytes() for path in kept_library.INDEX.parent.iterdir()}


def remove():
    for path in kept_library.INDEX.parent.iterdir():
        path.unlink()


def test_a_library_that_was_kept_is_installed_again(place, tmp_path):
    assert not kept_library.restored("state")
    before = install(tmp_path)
    kept_library.keep("state")
    remove()
    assert kept_library.restored("state")
    assert installed() == before and len(before) == 2


def test_the_library_that_is_there_gives_way(place, tmp_path):
    before = install(tmp_path)
    kept_library.keep("state")
    assert install(tmp_path, 2) != before
    assert kept_library.restored("state")
    assert installed() == before


@pytest.mark.parametrize("change", ["sources", "processor", "numba"])
def test_a_library_of_other_sources_or_for_another_machine_is_not_installed(change, place, tmp_path, monkeypatch):
    install(tmp_path)
    kept_library.keep("state")
    remove()
    if change == "processor":
        monkeypatch.setattr(kept_library, "processor", lambda: "another")
    elif change == "numba":
        monkeypatch.setattr(kept_library, "version", lambda name: "0.1")
    assert not kept_library.restored("another" if change == "sources" else "state") and not installed()


@pytest.mark.parametrize("damage", ["library cut", "library gone", "index cut", "index changed", "other contents"])
def test_a_damaged_one_is_not_installed(place, tmp_path, damage):
    install(tmp_path)
    kept_library.keep("state")
    remove()
    [library], [index] = (list((tmp_path / "cache").rglob(f"*.{kind}")) for kind in ("so", "json"))
    if damage == "library cut":
        os.truncate(library, 100)
    elif damage == "library gone":
        library.unlink()
    elif damage == "index cut":
        os.truncate(index, 80)
    elif damage == "index changed":
        index.write_text(index.read_text().replace('"contents"', '"Contents"'))
    else:
        # All as it should be, except that the file is no library.
        other, contents = b"no library", hashlib.sha256(b"no library").hexdigest()
        library.with_name("other.so").write_bytes(other)
        content = json.dumps({"library": "other.so", "contents": contents})
        index.write_text(f"{hashlib.sha256(content.encode()).hexdigest()}\n{content}")
    assert not kept_library.restored("state") and not installed()


def test_where_there_is_no_place_nothing_is_kept(place, tmp_path, monkeypatch):
    install(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc")
    kept_library.keep("state")
    assert not kept_library.restored("state")


def test_where_the_disk_is_full_nothing_is_left(place, tmp_path):
    install(tmp_path)
    with files_no_larger_than(100):
        kept_library.keep("state")
    assert not [path for path in (tmp_path / "cache").rglob("*") if path.is_file()]


def test_a_relative_folder_for_caches_is_ignored(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    install(tmp_path)
    kept_library.keep("state")
    assert not (tmp_path / "cache").exists() and (tmp_path / "home" / ".cache" / "hsv").is_dir()


def test_the_last_libraries_are_kept(place, tmp_path):
    for number in range(kept_library._MOST_KEPT):
        install(tmp_path, number)
        kept_library.keep(str(number))
        time.sleep(0.01)  # folders are told apart by their times
    assert kept_library.restored("0")  # which makes it the one that was used last
    time.sleep(0.01)
    kept_library.keep("another")
    kept = [number for number in range(kept_library._MOST_KEPT) if kept_library.restored(str(number))]
    assert kept == [0, *range(2, kept_library._MOST_KEPT)] and kept_library.restored("another")


@pytest.mark.parametrize("changed", ["before it is kept", "before it is installed"])
def test_what_was_compiled_of_other_sources_is_not_used(changed, place, tmp_path, monkeypatch):
    install(tmp_path)
    if changed == "before it is kept":
        with monkeypatch.context() as patch:
            patch.setattr(kept_library, "digest", lambda sources: "another")
            kept_library.keep("state")
        assert not (tmp_path / "cache").exists()
    else:
        kept_library.keep("state")
        monkeypatch.setattr(kept_library, "digest", lambda sources: "another")
    remove()
    assert not kept_library.restored("state") and not installed()


def test_what_numba_compiles_is_kept_beside_the_library_or_in_the_cache_of_the_user(place, tmp_path, monkeypatch):
    with monkeypatch.context() as homeless:
        homeless.setattr(kept_library, "_cache", lambda: Path("~nobody-of-this-name").expanduser())
        assert kept_library.numba_folder("state") == place.parent / "numba-state"
    monkeypatch.setattr(kept_library, "INDEX", Path("/proc/ahead_of_time.json"))
    assert kept_library.numba_folder("state") == tmp_path / "cache" / "hsv" / "numba-state"
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc")
    assert kept_library.numba_folder("state") is None
