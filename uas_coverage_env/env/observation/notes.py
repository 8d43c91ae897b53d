"""What several blocks of an observation need of a UAS: noted once, before they are written."""

from uas_coverage_env.compiled.memory import record_dtype

N_SECTORS = 8
"""Eighths of the horizon, from north over east."""

NORTH, EAST = N_SECTORS, N_SECTORS + 1
"""Places in `open_sums` behind those of the sectors: shares times their way north and east."""

NOTES_DTYPE = record_dtype(
    [
        # [m] end of the first leg of the way home, north and east
        ("leg_m", "f8", (2,)),
        # [m] length of the way home
        ("way_m", "f8"),
        # [m] how far the start is below
        ("below_m", "f8"),
        # depth of discharge that the way home costs
        ("home_dod", "f8"),
        # of the open waypoints: see `remaining`
        ("open_sums", "f8", (N_SECTORS + 2,)),
        # share of all weight that is still to be covered
        ("open_share", "f8"),
    ]
)
