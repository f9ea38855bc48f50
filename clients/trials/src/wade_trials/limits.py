"""Limits of the checks, each with its unit and its reason."""

#: Cosine of the tilt above which a vehicle stands on its wheels: 26 degrees, steeper than a ramp.
MIN_UP = 0.9
#: Cosine of the tilt up to which a vehicle stands on flat ground: 15 degrees.
LEVEL = 0.966
#: Depth of the recording and depth measured at rest may differ by this [m]: markers, tires and waves.
DEPTH_TOLERANCE = 0.05
#: Share of the frames that lie level at the stated depth at least: the rest may be ramps.
MIN_SHARE_AT_DEPTH = 0.1
#: Speed from which a vehicle moves [m/s].
MOVING = 0.3
#: Share of a moving vehicle's velocity along body z, and along body y, above which the axes are in doubt: wheels roll.
MAX_VERTICAL, MAX_LATERAL = 0.3, 0.5
#: Sine of the angle between velocity and body x, rms, above which a conjugate quaternion that halves it is the right
#: one: 6 degrees, more than the change of a slope under the wheels makes.
ASTRAY = 0.1
#: No vehicle turns faster [rad/s], and what noise of markers adds between two frames [m, rad].
MAX_TURN, MARKER_NOISE, MARKER_NOISE_TURN = 10.0, 0.02, 0.1
#: Time between the two frames of a difference [s]: noise of a millimeter makes 0.01 m/s.
DIFFERENCE = 0.1
#: Frames of a recording that a check looks at.
MOST_FRAMES = 2000
#: A vehicle below these is at rest [m/s, rad/s], if it lasts [s].
REST_SPEED, REST_RATE, REST_DURATION = 0.05, 0.1, 0.5
#: A channel that keeps one value to the last bit for longer than this [s] and this many samples is frozen ...
FROZEN_DURATION, FROZEN_SAMPLES = 0.5, 20
#: ... if it changes in this share of its other steps: a channel of few counts repeats itself.
LIVE_SHARE = 0.5
#: A measured lift at rest may differ from rho g V by this share, and by what this much depth makes [m].
LIFT_SHARE, LIFT_DEPTH = 0.15, 0.02
#: Standard gravity as in wade [m/s2], and what an accelerometer at rest may miss it by [m/s2], in all and in direction.
GRAVITY, GRAVITY_TOLERANCE, DIRECTION_TOLERANCE = 9.81, 0.7, 2.0
#: Two signals say the same but for a factor if they correlate as well as this, and move by this [rad/s or rad].
MIN_CORRELATION, MIN_MOTION = 0.7, 0.02
#: Share by which noise may bend a factor between two units.
FACTOR_TOLERANCE = 0.3
#: Radii of wheels [m].
WHEEL_RADIUS = (0.05, 1.0)
#: No recording steps by as much as this [s].
LONG_STEP = 1.0
#: Share of samples with the stamp of the one before above which stamps are rounded: a few are sent twice.
REPEATED_STAMPS = 0.5
