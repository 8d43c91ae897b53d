"""The order of states and inputs (Gasche et al., Sec. II).

Frame: NED, metres: x north, y east, z down (altitude is -z); body axes forward, right, down.
"""

X, Y, Z, VX, VY, VZ, PHI, THETA, PSI, WX, WY, WZ, DOD, U_TH = range(14)
"""Position [m], velocity [m/s], Euler angles [rad], body rates [rad/s], depth of discharge,
polarisation voltage [V]."""

LIFT, TAU_X, TAU_Y, TAU_Z, DELTA_THRUST = range(5)
"""Lift in excess of the weight [N], torques [N m], corrected thrust deviation [N]."""

N_STATES = 14
N_INPUTS = 5
