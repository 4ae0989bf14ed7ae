"""The C header of a model of free numerators, which `jaxident.export.c_header` fills in; helpers of both headers."""

HELPERS = """
static inline double robot_clip(double x, double low, double high) { return x < low ? low : x > high ? high : x; }
static inline double robot_sign(double x) { return (double)((x > 0.0) - (x < 0.0)); }
static inline double robot_pick(int condition, double a, double b) { return condition ? a : b; }
static inline double robot_past(double u, double forward, double backward)
{
    if (forward < 0.0) forward = 0.0;
    if (backward < 0.0) backward = 0.0;
    return u > forward ? u - forward : u < -backward ? u + backward : 0.0;
}
/* The command of which m passes a dead zone: its inverse, 0 for 0. */
static inline double robot_before(double m, double forward, double backward)
{
    if (m > 0.0) return forward > 0.0 ? m + forward : m;
    if (m < 0.0) return backward > 0.0 ? m - backward : m;
    return 0.0;
}
"""

DIFFERENCE = (
    """/* A differential-drive robot as difference equations at ROBOT_PERIOD: commands in, increments and pose out. C99,
 * link with -lm.
$HEAD
 *
 * struct robot r;
 * robot_init(&r);                          at rest at the origin, heading along x
 * robot_step(&r, u_r, u_l);                holds both commands for ROBOT_PERIOD
 * robot_command(v, w, &u_r, &u_l);         commands that hold these speeds: steady state and inverse dead zone
 */
#ifndef JAXIDENT_ROBOT_H
#define JAXIDENT_ROBOT_H

#include <math.h>

#define ROBOT_PERIOD $PERIOD /* [s] */

static const double ROBOT_ALPHA[2] = {$ALPHA_V, $ALPHA_W};
static const double ROBOT_DELTA[2][2] = {{$DELTA_VR, $DELTA_VL}, {$DELTA_WR, $DELTA_WL}}; /* [m, rad per unit] */
static const double ROBOT_EPSILON[2][2] = {{$EPSILON_VR, $EPSILON_VL}, {$EPSILON_WR, $EPSILON_WL}};
static const double ROBOT_INVERSE[2][2] = {{$INVERSE_RV, $INVERSE_RW}, {$INVERSE_LV, $INVERSE_LW}};
static const double ROBOT_ZONE[2] = {$ZONE_R, $ZONE_L}; /* [unit of command] */

struct robot {
    double x, y, theta;   /* [m], [rad] */
    double length, turn;  /* of the last step [m], [rad] */
    double m_r, m_l;      /* pushes of the last step */
};
"""
    + HELPERS
    + """
static inline void robot_init(struct robot *robot)
{
    robot->x = robot->y = robot->theta = robot->length = robot->turn = robot->m_r = robot->m_l = 0.0;
}

/* Length of the Bezier curve between two poses over its chord, by Gauss and Legendre's rule of four nodes. */
static inline double robot_over_chord(double turn)
{
    double cosine = cos(0.5 * turn) / 3.0, sine = sin(0.5 * turn) / 3.0, length = 0.0;
    int k;
    for (k = 0; k < 4; ++k) {
        double inner = k < 2 ? 1.0 : -1.0, side = k % 2 ? 1.0 : -1.0;
        double p = 0.5 + 0.5 * side * sqrt(3.0 / 7.0 + inner * 2.0 / 7.0 * sqrt(1.2)), q = 1.0 - p;
        double along = 3.0 * ((q * q + p * p) * cosine + 2.0 * p * q * (1.0 - 2.0 * cosine));
        double aside = 3.0 * (p * p - q * q) * sine;
        length += (18.0 - inner * sqrt(30.0)) / 72.0 * sqrt(along * along + aside * aside);
    }
    return length;
}

static inline void robot_step(struct robot *robot, double u_r, double u_l)
{
    double m_r = robot_past(u_r, ROBOT_ZONE[0], ROBOT_ZONE[0]), m_l = robot_past(u_l, ROBOT_ZONE[1], ROBOT_ZONE[1]);
    double chord, middle;
    robot->length = ROBOT_ALPHA[0] * robot->length + ROBOT_DELTA[0][0] * m_r + ROBOT_DELTA[0][1] * m_l
                    - ROBOT_EPSILON[0][0] * robot->m_r - ROBOT_EPSILON[0][1] * robot->m_l;
    robot->turn = ROBOT_ALPHA[1] * robot->turn + ROBOT_DELTA[1][0] * m_r + ROBOT_DELTA[1][1] * m_l
                  - ROBOT_EPSILON[1][0] * robot->m_r - ROBOT_EPSILON[1][1] * robot->m_l;
    robot->m_r = m_r;
    robot->m_l = m_l;
    chord = robot->length / robot_over_chord(robot->turn);
    middle = robot->theta + 0.5 * robot->turn;
    robot->x += chord * cos(middle);
    robot->y += chord * sin(middle);
    robot->theta += robot->turn;
}

static inline void robot_command(double v, double w, double *u_r, double *u_l)
{
    double length = v * ROBOT_PERIOD, turn = w * ROBOT_PERIOD;
    *u_r = robot_before(ROBOT_INVERSE[0][0] * length + ROBOT_INVERSE[0][1] * turn, ROBOT_ZONE[0], ROBOT_ZONE[0]);
    *u_l = robot_before(ROBOT_INVERSE[1][0] * length + ROBOT_INVERSE[1][1] * turn, ROBOT_ZONE[1], ROBOT_ZONE[1]);
}

#endif
"""
)
