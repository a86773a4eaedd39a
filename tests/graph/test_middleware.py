"""Settings of Fast DDS: ours by default, others where somebody has them."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from hsv_node.middleware import PROFILES, prefer_profiles


def test_our_settings_are_the_default(tmp_path):
    environment: dict[str, str] = {}
    prefer_profiles(environment, tmp_path)
    assert environment == {"FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILES)}
    profiles = [profile.tag.rpartition("}")[2] for profile in ElementTree.parse(PROFILES).getroot()[0]]
    assert profiles == ["participant", "data_writer"]


@pytest.mark.parametrize("name", ["FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"])
def test_settings_named_in_the_environment_hold_alone(tmp_path, name):
    environment = {name: "mine.xml"}
    prefer_profiles(environment, tmp_path)
    assert environment == {name: "mine.xml"}


def test_settings_in_the_working_directory_hold_alone(tmp_path):
    Path(tmp_path, "DEFAULT_FASTRTPS_PROFILES.xml").touch()
    environment: dict[str, str] = {}
    prefer_profiles(environment, tmp_path)
    assert not environment
