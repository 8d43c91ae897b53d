"""A block with data of its own, as a user writes it: one file outside the package."""

import numpy as np

from uas_coverage_env.geometry import cylinder_faces


class RadioRange:
    """f · (p(n) - p_station) <= R(t) + beyond(n), n = 1..N, per UAS and horizontal face.

    The station stands where the first UAS starts; its range shrinks to a share at a time.
    """

    def __init__(self, range_m=70.0, share=1.0, from_s=0.0, price=50.0):
        self.range_m, self.share, self.from_s, self.price = range_m, share, from_s, price

    def data(self, brief, swarm):
        share = self.share if swarm.time_s >= self.from_s else 1.0
        return {"station_m": np.array(brief.uas[0].start_m), "range_m": share * self.range_m}

    def add_to(self, milp, v, problem):
        own = problem.data_of(self)
        faces = cylinder_faces(problem.limit_sides)
        for uas, name in enumerate(problem.names):
            beyond = milp.variables(f"radio.{name}", (problem.horizon,), lower=0.0)
            milp.subject_to(
                f"radio.{name}",
                (faces, v.position[uas, 1:, None, :]),
                (-1.0, beyond[:, None, None]),
                upper=own["range_m"] + faces @ own["station_m"],
            )
            milp.minimize(self.price, beyond)
