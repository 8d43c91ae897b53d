"""The order of states and inputs (Gasche et al., Sec. II).

Frame: NED, metres: x north, y east, z down (altitude is -z); body axes forward, right, down.
"""

X, Y, Z, VX, VY, VZ, PHI, THETA, PSI, WX, WY, WZ, DOD, U_TH = range(14)
"""Position [m], velocity [m/s], Euler angles [rad], body rates [rad/s], depth of discharge,
polarisation voltage [V].

The model of the plan is linearised at heading 0: there, roll and pitch are tilts about north and
east. A UAS that looks where it flies (`heading = "course"`) keeps these axes. Its PHI, THETA, WX
and WY are those of a body that has not turned; PSI is the angle by which it has turned about its
own vertical axis from there, which goes on counting beyond a half turn, and WZ its rate; torques
are about the axes of the tilts. `attitude.body_attitude` has roll, pitch and yaw of its body."""

POSITION, SPEED, TILT, RATE = range(4)
"""States of the model of one axis: place and speed along it, and for a horizontal one the tilt that
pushes along it and the rate of this tilt (`governor.horizontal_axis`)."""

LIFT, TAU_X, TAU_Y, TAU_Z, DELTA_THRUST = range(5)
"""Lift in excess of the weight [N], torques [N m], corrected thrust deviation [N]."""

SOC, VOLTAGE, CURRENT = range(3)
"""Outputs of the model: state of charge, terminal voltage [V], current [A]."""

N_STATES = 14
N_INPUTS = 5
