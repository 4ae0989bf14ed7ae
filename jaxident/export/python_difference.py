"""The Python program of a model of free numerators, which `jaxident.export.python` fills in; helpers of both."""

HELPERS = '''

def clip(x, low, high):
    """x between two limits."""
    return min(max(x, low), high)


def sign(x):
    """1.0, -1.0 or 0.0."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


def pick(condition, a, b):
    """a if the condition holds, else b."""
    return a if condition else b


def round_even(x):
    """The nearest whole number, the even one of two."""
    return float(round(x))


def past(u, forward, backward):
    """What of a command passes a dead zone."""
    forward, backward = max(forward, 0.0), max(backward, 0.0)
    return u - forward if u > forward else u + backward if u < -backward else 0.0


def before(m, forward, backward):
    """The command of which m passes a dead zone: its inverse, 0 for 0."""
    return m + max(forward, 0.0) if m > 0.0 else m - max(backward, 0.0) if m < 0.0 else 0.0

'''

DIFFERENCE = (
    '''"""A differential-drive robot as difference equations at PERIOD: commands in, increments and pose out.

$HEAD

robot = Robot()                 at rest at the origin, heading along x
robot.step(u_r, u_l)            holds both commands for PERIOD; gives the pose (x, y, theta)
robot.length, robot.turn        path length [m] and turn [rad] of the step; over PERIOD they are the mean speeds
robot.command(v, w)             commands that hold these speeds [m/s], [rad/s]: steady state and inverse dead zone
"""

from math import cos, sin, sqrt

PERIOD = $PERIOD  # [s]
ALPHA_V, ALPHA_W = $ALPHA_V, $ALPHA_W
DELTA_VR, DELTA_VL, EPSILON_VR, EPSILON_VL = $DELTA_VR, $DELTA_VL, $EPSILON_VR, $EPSILON_VL  # [m per unit]
DELTA_WR, DELTA_WL, EPSILON_WR, EPSILON_WL = $DELTA_WR, $DELTA_WL, $EPSILON_WR, $EPSILON_WL  # [rad per unit]
INVERSE_RV, INVERSE_RW = $INVERSE_RV, $INVERSE_RW
INVERSE_LV, INVERSE_LW = $INVERSE_LV, $INVERSE_LW
ZONE_R, ZONE_L = $ZONE_R, $ZONE_L  # [unit of command]
'''
    + HELPERS
    + '''
def over_chord(turn):
    """Length of the Bezier curve between two poses over its chord, by Gauss and Legendre's rule of four nodes."""
    cosine, sine = cos(0.5 * turn) / 3.0, sin(0.5 * turn) / 3.0
    length = 0.0
    for far, weight in ((sqrt(3.0 / 7.0 + 2.0 / 7.0 * sqrt(1.2)), (18.0 - sqrt(30.0)) / 72.0),
                        (sqrt(3.0 / 7.0 - 2.0 / 7.0 * sqrt(1.2)), (18.0 + sqrt(30.0)) / 72.0)):
        for side in (-1.0, 1.0):
            p = 0.5 + 0.5 * side * far
            q = 1.0 - p
            along = 3.0 * ((q * q + p * p) * cosine + 2.0 * p * q * (1.0 - 2.0 * cosine))
            length += weight * sqrt(along * along + (3.0 * (p * p - q * q) * sine) ** 2)
    return length


class Robot:
    """State and step of the robot."""

    def __init__(self, x=0.0, y=0.0, theta=0.0, v=0.0, w=0.0):
        self.x, self.y, self.theta = x, y, theta
        self.length, self.turn, self.m_r, self.m_l = v * PERIOD, w * PERIOD, 0.0, 0.0

    def step(self, u_r, u_l):
        """Hold both commands for PERIOD; the pose (x, y, theta) afterwards."""
        m_r, m_l = past(u_r, ZONE_R, ZONE_R), past(u_l, ZONE_L, ZONE_L)
        self.length = (ALPHA_V * self.length + DELTA_VR * m_r + DELTA_VL * m_l
                       - EPSILON_VR * self.m_r - EPSILON_VL * self.m_l)
        self.turn = (ALPHA_W * self.turn + DELTA_WR * m_r + DELTA_WL * m_l
                     - EPSILON_WR * self.m_r - EPSILON_WL * self.m_l)
        self.m_r, self.m_l = m_r, m_l
        chord, middle = self.length / over_chord(self.turn), self.theta + 0.5 * self.turn
        self.x, self.y = self.x + chord * cos(middle), self.y + chord * sin(middle)
        self.theta += self.turn
        return self.x, self.y, self.theta

    def command(self, v, w):
        """Commands (u_r, u_l) that hold speeds v, w."""
        length, turn = v * PERIOD, w * PERIOD
        u_r = before(INVERSE_RV * length + INVERSE_RW * turn, ZONE_R, ZONE_R)
        u_l = before(INVERSE_LV * length + INVERSE_LW * turn, ZONE_L, ZONE_L)
        return u_r, u_l
'''
)
