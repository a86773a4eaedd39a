from hsv.flight.sources import drop_older


def test_only_the_newest_of_a_name_is_kept(tmp_path):
    new, old = "0123456789ab", "ba9876543210"
    for name in (f"case1_{new}", f"case1_{old}", f"case1_no_notch_{old}"):
        (tmp_path / name).mkdir()
        (tmp_path / f"{name}.npz").touch()
    drop_older(tmp_path / f"case1_{new}")
    drop_older(tmp_path / f"case1_{new}.npz")
    kept = {path.name.removesuffix(".npz") for path in tmp_path.iterdir()}
    assert kept == {f"case1_{new}", f"case1_no_notch_{old}"}
