def test_a_command_for_ssh_that_is_empty_is_named(hsv):
    ran = hsv("cluster", "127.0.0.1", "--ssh", "")
    assert ran.code == 2
    assert ran.error.startswith("ssh = '': expected a command of this machine, with options")
