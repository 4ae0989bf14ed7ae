"""The Python program of a physical model, which `jaxident.export.python` fills in."""

from jaxident.export.python_difference import HELPERS

PHYSICAL = (
    '''"""A differential-drive robot: commands in, speeds and pose out.

$HEAD

robot = Robot()                 at rest at the origin, heading along x; session time 0
robot.step(u_r, u_l)            holds both commands for PERIOD, or another time [s]; gives the pose that a camera sees
robot.v, robot.w                speeds [m/s], [rad/s] after the step; robot.x, robot.y, robot.theta: the axle's pose
robot.m_r, robot.m_l            mean pushes of the wheels over the step, dead zones and motors passed
robot.goal()                    speeds (v, w) that these pushes lead to in the end
robot.command(v, w, a_v, a_w)   commands for these speeds and accelerations: feed-forward and inverse dead zone
"""

from math import ceil, cos, exp, fabs, sin, sqrt, tanh  # noqa: F401

PERIOD = $PERIOD  # [s]
SUBSTEPS = $SUBSTEPS
SHORTEST = 1e-12  # [s], below which nothing moves
RATE_V, RATE_W = $RATE_V, $RATE_W  # [1/s]
COUPLING_V, COUPLING_W = $COUPLING_V, $COUPLING_W  # [m/s^2 per rad/s], [rad/s^2 per m/s]
GAIN_VR, GAIN_VL = $GAIN_VR, $GAIN_VL  # [m/s^2 per unit of command]
GAIN_WR, GAIN_WL = $GAIN_WR, $GAIN_WL  # [rad/s^2 per unit of command]
INVERSE_RV, INVERSE_RW = $INVERSE_RV, $INVERSE_RW
INVERSE_LV, INVERSE_LW = $INVERSE_LV, $INVERSE_LW
ZONE_R, ZONE_L = $ZONE_R, $ZONE_L  # [unit of command]
'''
    + HELPERS
    + '''
class Robot:
    """State and step of the robot."""

    def __init__(self, x=0.0, y=0.0, theta=0.0, v=0.0, w=0.0, time=0.0):
        self.x, self.y, self.theta, self.v, self.w, self.time = x, y, theta, v, w, time
        self.held_r = self.held_l = self.m_r = self.m_l = 0.0
        self.queue = []
        $MEMORY

    def step(self, u_r, u_l, h=PERIOD):
        """Hold both commands for h [s]; the pose (x, y, theta) that a camera sees afterwards."""
        time, u_r, u_l = self.time, float(u_r), float(u_l)
        $COMMAND
        $ARRIVAL
        self.queue.append((time, u_r, u_l))
        begin, self.m_r, self.m_l = self.time, 0.0, 0.0
        for k in range(SUBSTEPS):
            until = begin + h * (k + 1) / SUBSTEPS
            while self.queue and self.queue[0][0] <= until:
                when, held_r, held_l = self.queue.pop(0)
                self._go(when - self.time, h)
                self.held_r, self.held_l = held_r, held_l
            self._go(until - self.time, h)
        return self.seen()

    def seen(self):
        """The pose (x, y, theta) that a camera sees."""
        x, y, theta = self.x, self.y, self.theta
        sn, cs = sin(theta), cos(theta)
        $OPTICS
        return x, y, theta

    def goal(self):
        """Speeds (v, w) at rest of the last step's pushes."""
        along = GAIN_VR * self.m_r + GAIN_VL * self.m_l
        heading = GAIN_WR * self.m_r + GAIN_WL * self.m_l
        determinant = RATE_V * RATE_W - COUPLING_V * COUPLING_W
        v = (RATE_W * along + COUPLING_V * heading) / determinant
        return v, (RATE_V * heading + COUPLING_W * along) / determinant

    def command(self, v, w, a_v=0.0, a_w=0.0):
        """Commands (u_r, u_l) that hold speeds v, w and give accelerations a_v, a_w."""
        time = self.time
        along = a_v + RATE_V * v - COUPLING_V * w
        heading = a_w + RATE_W * w - COUPLING_W * v
        f_r, f_l, b_r, b_l = ZONE_R, ZONE_L, ZONE_R, ZONE_L
        $ZONE
        u_r = before(INVERSE_RV * along + INVERSE_RW * heading, f_r, b_r)
        u_l = before(INVERSE_LV * along + INVERSE_LW * heading, f_l, b_l)
        return u_r, u_l

    def _go(self, dt, h):
        if dt <= SHORTEST:
            return
        time, u_r, u_l = self.time + 0.5 * dt, self.held_r, self.held_l
        v, w = self.v, self.w
        n_r = INVERSE_RV * RATE_V * v + INVERSE_RW * RATE_W * w
        n_l = INVERSE_LV * RATE_V * v + INVERSE_LW * RATE_W * w
        $SLEW
        f_r, f_l, b_r, b_l = ZONE_R, ZONE_L, ZONE_R, ZONE_L
        $ZONE
        m_r, m_l = past(u_r, f_r, b_r), past(u_l, f_l, b_l)
        $MOTOR
        $GEAR
        self.m_r, self.m_l = self.m_r + m_r * dt / h, self.m_l + m_l * dt / h
        factor, rub_r, rub_l = 1.0, 0.0, 0.0
        $LOAD
        start = (self.x, self.y, self.theta, v, w)
        end = self._moved(start, m_r, m_l, factor, dt)
        free_r = INVERSE_RV * RATE_V * end[3] + INVERSE_RW * RATE_W * end[4]
        free_l = INVERSE_LV * RATE_V * end[3] + INVERSE_LW * RATE_W * end[4]
        for _ in range($ROUNDS - 1):
            rub_r, rub_l = _rubbed(n_r, n_l, free_r, free_l, factor, dt)
            end = self._moved(start, m_r - rub_r, m_l - rub_l, factor, dt)
            n_r = 0.5 * (n_r + INVERSE_RV * RATE_V * end[3] + INVERSE_RW * RATE_W * end[4])
            n_l = 0.5 * (n_l + INVERSE_LV * RATE_V * end[3] + INVERSE_LW * RATE_W * end[4])
        self.x, self.y, self.theta, self.v, self.w = end
        self.time += dt

    def _moved(self, start, m_r, m_l, factor, dt):
        k1 = _rates(start, m_r, m_l, factor)
        k2 = _rates([s + 0.5 * dt * k for s, k in zip(start, k1)], m_r, m_l, factor)
        k3 = _rates([s + 0.5 * dt * k for s, k in zip(start, k2)], m_r, m_l, factor)
        k4 = _rates([s + dt * k for s, k in zip(start, k3)], m_r, m_l, factor)
        rows = zip(start, k1, k2, k3, k4)
        return [s + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d) for s, a, b, c, d in rows]


def _rubbed(n_r, n_l, free_r, free_l, factor, dt):
    """Mean dry friction of both wheels, which would reach the speeds `free` without it."""
    k_r = k_l = 0.0
    $FRICTION
    once_v, once_w = factor * dt * (1.0 - 0.5 * RATE_V * dt), factor * dt * (1.0 - 0.5 * RATE_W * dt)
    m_rr = INVERSE_RV * RATE_V * once_v * GAIN_VR + INVERSE_RW * RATE_W * once_w * GAIN_WR
    m_rl = INVERSE_RV * RATE_V * once_v * GAIN_VL + INVERSE_RW * RATE_W * once_w * GAIN_WL
    m_lr = INVERSE_LV * RATE_V * once_v * GAIN_VR + INVERSE_LW * RATE_W * once_w * GAIN_WR
    m_ll = INVERSE_LV * RATE_V * once_v * GAIN_VL + INVERSE_LW * RATE_W * once_w * GAIN_WL
    rub_r = rub_l = 0.0
    for _ in range(4):
        rub_r = clip((free_r - m_rl * rub_l) / m_rr, -k_r, k_r)
        rub_l = clip((free_l - m_lr * rub_r) / m_ll, -k_l, k_l)
    return rub_r, rub_l


def _rates(state, m_r, m_l, factor):
    """How fast x, y, theta, v, w change."""
    _, _, theta, v, w = state
    a_v = -RATE_V * v + COUPLING_V * w + GAIN_VR * m_r + GAIN_VL * m_l
    a_w = -RATE_W * w + COUPLING_W * v + GAIN_WR * m_r + GAIN_WL * m_l
    c_r, c_l = INVERSE_RV * a_v + INVERSE_RW * a_w, INVERSE_LV * a_v + INVERSE_LW * a_w
    $GRIP
    a_v, a_w = factor * (GAIN_VR * c_r + GAIN_VL * c_l), factor * (GAIN_WR * c_r + GAIN_WL * c_l)
    $BODY
    aside = 0.0
    $SIDE
    sn, cs = sin(theta), cos(theta)
    return v * cs - aside * sn, v * sn + aside * cs, w, a_v, a_w
'''
)
