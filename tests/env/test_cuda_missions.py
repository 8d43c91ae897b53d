from uas_coverage_env.world import SWAPPING


def test_missions_on_a_simulated_gpu_are_bit_for_bit_those_of_episodes(flown_on_gpu):
    flown = dict(flown_on_gpu["missions"])
    swapped = flown.pop("packs")
    assert swapped["different"] == 0
    assert SWAPPING in swapped["statuses"]
    for result in flown.values():
        assert result["different"] == 0
        assert result["restarts"] >= 2
        assert result["refused"] == [True, False]
        assert result["changed"] == [False, True]
        assert result["acted"] > 20
    assert flown["windy"]["x"] != flown["still"]["x"]
    assert flown["still"]["limits_exceeded"] == [
        [],
        ["tilt", "tilt_rate"],
        ["speed", "tilt", "tilt_rate"],
    ]
