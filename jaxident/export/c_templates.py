"""The C header of a physical model, which `jaxident.export.c_header` fills in."""

from jaxident.export.c_difference import HELPERS

PHYSICAL = (
    """/* A differential-drive robot: commands in, speeds and pose out. C99, link with -lm.
$HEAD
 *
 * struct robot r;
 * robot_init(&r);                    at rest at the origin, heading along x; session time 0
 * robot_step(&r, u_r, u_l, h);       holds both commands for h [s], usually ROBOT_PERIOD; 0, or -1 if more commands
 *                                    are under way than ROBOT_QUEUE (h much below ROBOT_PERIOD): the last one is lost
 * robot_seen(&r, pose);              pose {x, y, theta} that a camera sees
 * robot_command(&r, v, w, a_v, a_w, &u_r, &u_l);   commands for these speeds and accelerations: feed-forward and
 *                                    inverse dead zone
 */
#ifndef JAXIDENT_ROBOT_H
#define JAXIDENT_ROBOT_H

#include <math.h>

#define ROBOT_PERIOD $PERIOD /* [s] */
#define ROBOT_QUEUE $QUEUE
#define ROBOT_SUBSTEPS $SUBSTEPS
#define ROBOT_SHORTEST 1e-12 /* [s], below which nothing moves */

static const double ROBOT_RATE[2] = {$RATE_V, $RATE_W}; /* [1/s] */
static const double ROBOT_COUPLING[2] = {$COUPLING_V, $COUPLING_W}; /* [m/s^2 per rad/s], [rad/s^2 per m/s] */
static const double ROBOT_GAIN[2][2] = {{$GAIN_VR, $GAIN_VL}, {$GAIN_WR, $GAIN_WL}}; /* right, left; per unit */
static const double ROBOT_INVERSE[2][2] = {{$INVERSE_RV, $INVERSE_RW}, {$INVERSE_LV, $INVERSE_LW}};
static const double ROBOT_ZONE[2] = {$ZONE_R, $ZONE_L}; /* [unit of command] */

struct robot {
    double x, y, theta, v, w, time; /* of the axle; session time */
    double held_r, held_l;          /* commands that act now */
    double m_r, m_l;                /* mean pushes over the last step, dead zones and motors passed */
    double when[ROBOT_QUEUE], u_r[ROBOT_QUEUE], u_l[ROBOT_QUEUE];
    int first, count;
    $MEMORY
};
"""
    + HELPERS
    + """
static inline void robot_init(struct robot *robot)
{
    robot->x = robot->y = robot->theta = robot->v = robot->w = robot->time = 0.0;
    robot->held_r = robot->held_l = robot->m_r = robot->m_l = 0.0;
    robot->first = robot->count = 0;
    $FORGET
}

/* How fast x, y, theta, v, w change. */
static inline void robot_rates(const double *s, double m_r, double m_l, double factor, double *rate)
{
    double theta = s[2], v = s[3], w = s[4], aside = 0.0, a = 0.0, b = 0.0, c = 0.0, d = 0.0;
    double a_v = -ROBOT_RATE[0] * v + ROBOT_COUPLING[0] * w + ROBOT_GAIN[0][0] * m_r + ROBOT_GAIN[0][1] * m_l;
    double a_w = -ROBOT_RATE[1] * w + ROBOT_COUPLING[1] * v + ROBOT_GAIN[1][0] * m_r + ROBOT_GAIN[1][1] * m_l;
    double c_r = ROBOT_INVERSE[0][0] * a_v + ROBOT_INVERSE[0][1] * a_w;
    double c_l = ROBOT_INVERSE[1][0] * a_v + ROBOT_INVERSE[1][1] * a_w;
    (void)a; (void)b; (void)c; (void)d;
    $GRIP
    a_v = factor * (ROBOT_GAIN[0][0] * c_r + ROBOT_GAIN[0][1] * c_l);
    a_w = factor * (ROBOT_GAIN[1][0] * c_r + ROBOT_GAIN[1][1] * c_l);
    $BODY
    $SIDE
    rate[0] = v * cos(theta) - aside * sin(theta);
    rate[1] = v * sin(theta) + aside * cos(theta);
    rate[2] = w;
    rate[3] = a_v;
    rate[4] = a_w;
}

/* One step of Runge and Kutta's method of order four. */
static inline void robot_moved(const double *start, double m_r, double m_l, double factor, double dt, double *end)
{
    static const double part[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double rate[5] = {0.0, 0.0, 0.0, 0.0, 0.0}, place[5], sum[5] = {0.0, 0.0, 0.0, 0.0, 0.0};
    int k, i;
    for (k = 0; k < 4; ++k) {
        for (i = 0; i < 5; ++i) place[i] = start[i] + part[k] * dt * rate[i];
        robot_rates(place, m_r, m_l, factor, rate);
        for (i = 0; i < 5; ++i) sum[i] += weight[k] * rate[i];
    }
    for (i = 0; i < 5; ++i) end[i] = start[i] + dt / 6.0 * sum[i];
}

/* Both wheels' speeds as the commands that hold them. */
static inline void robot_wheels(double v, double w, double *n)
{
    n[0] = ROBOT_INVERSE[0][0] * ROBOT_RATE[0] * v + ROBOT_INVERSE[0][1] * ROBOT_RATE[1] * w;
    n[1] = ROBOT_INVERSE[1][0] * ROBOT_RATE[0] * v + ROBOT_INVERSE[1][1] * ROBOT_RATE[1] * w;
}

/* Mean dry friction of both wheels at speeds n, which would reach the speeds `reached` without it. */
static inline void robot_rubbed(const double *n, const double *reached, double factor, double dt, double *rub)
{
    double n_r = n[0], n_l = n[1], k_r = 0.0, k_l = 0.0, once[2], right[2], left[2];
    int k;
    (void)n_r; (void)n_l;
    $FRICTION
    for (k = 0; k < 2; ++k) once[k] = factor * dt * (1.0 - 0.5 * ROBOT_RATE[k] * dt);
    robot_wheels(once[0] * ROBOT_GAIN[0][0], once[1] * ROBOT_GAIN[1][0], right);
    robot_wheels(once[0] * ROBOT_GAIN[0][1], once[1] * ROBOT_GAIN[1][1], left);
    rub[0] = rub[1] = 0.0;
    for (k = 0; k < 4; ++k) {
        rub[0] = robot_clip((reached[0] - left[0] * rub[1]) / right[0], -k_r, k_r);
        rub[1] = robot_clip((reached[1] - right[1] * rub[0]) / left[1], -k_l, k_l);
    }
}

static inline void robot_zone(double time, double *width)
{
    double f_r = ROBOT_ZONE[0], f_l = ROBOT_ZONE[1], b_r = ROBOT_ZONE[0], b_l = ROBOT_ZONE[1];
    double a = 0.0, b = 0.0, c = 0.0;
    (void)a; (void)b; (void)c; (void)time;
    $ZONE
    width[0] = f_r; width[1] = f_l; width[2] = b_r; width[3] = b_l;
}

static inline void robot_go(struct robot *robot, double dt, double h)
{
    double time = robot->time + 0.5 * dt, u_r = robot->held_r, u_l = robot->held_l, m_r, m_l, factor = 1.0;
    double a = 0.0, b = 0.0, c = 0.0, d = 0.0, n_r, n_l, width[4], n[2], after[2], rub[2], end[5];
    double start[5] = {robot->x, robot->y, robot->theta, robot->v, robot->w};
    int k;
    (void)a; (void)b; (void)c; (void)d; (void)time;
    if (dt <= ROBOT_SHORTEST) return;
    robot_wheels(robot->v, robot->w, n);
    n_r = n[0]; n_l = n[1];
    (void)n_r; (void)n_l;
    $SLEW
    robot_zone(time, width);
    m_r = robot_past(u_r, width[0], width[2]);
    m_l = robot_past(u_l, width[1], width[3]);
    $MOTOR
    $GEAR
    robot->m_r += m_r * dt / h;
    robot->m_l += m_l * dt / h;
    $LOAD
    robot_moved(start, m_r, m_l, factor, dt, end);
    robot_wheels(end[3], end[4], after);
    for (k = 0; k < $ROUNDS - 1; ++k) {
        double now[2];
        robot_rubbed(n, after, factor, dt, rub);
        robot_moved(start, m_r - rub[0], m_l - rub[1], factor, dt, end);
        robot_wheels(end[3], end[4], now);
        n[0] = 0.5 * (n[0] + now[0]);
        n[1] = 0.5 * (n[1] + now[1]);
    }
    robot->x = end[0]; robot->y = end[1]; robot->theta = end[2]; robot->v = end[3]; robot->w = end[4];
    robot->time += dt;
}

static inline int robot_step(struct robot *robot, double u_r, double u_l, double h)
{
    double begin = robot->time, time = robot->time, a = 0.0, b = 0.0;
    int k, full = robot->count == ROBOT_QUEUE;
    (void)a; (void)b;
    $COMMAND
    $ARRIVAL
    if (!full) {
        k = (robot->first + robot->count++) % ROBOT_QUEUE;
        robot->when[k] = time; robot->u_r[k] = u_r; robot->u_l[k] = u_l;
    }
    robot->m_r = robot->m_l = 0.0;
    for (k = 0; k < ROBOT_SUBSTEPS; ++k) {
        double until = begin + h * (k + 1) / ROBOT_SUBSTEPS;
        while (robot->count && robot->when[robot->first] <= until) {
            robot_go(robot, robot->when[robot->first] - robot->time, h);
            robot->held_r = robot->u_r[robot->first];
            robot->held_l = robot->u_l[robot->first];
            robot->first = (robot->first + 1) % ROBOT_QUEUE;
            --robot->count;
        }
        robot_go(robot, until - robot->time, h);
    }
    return full ? -1 : 0;
}

static inline void robot_seen(const struct robot *robot, double *pose)
{
    double x = robot->x, y = robot->y, theta = robot->theta, sn = sin(theta), cs = cos(theta);
    double a = 0.0, b = 0.0, c = 0.0;
    (void)a; (void)b; (void)c; (void)sn; (void)cs;
    $OPTICS
    pose[0] = x; pose[1] = y; pose[2] = theta;
}

static inline void robot_command(const struct robot *robot, double v, double w, double a_v, double a_w,
                                 double *u_r, double *u_l)
{
    double along = a_v + ROBOT_RATE[0] * v - ROBOT_COUPLING[0] * w, width[4];
    double heading = a_w + ROBOT_RATE[1] * w - ROBOT_COUPLING[1] * v;
    robot_zone(robot->time, width);
    *u_r = robot_before(ROBOT_INVERSE[0][0] * along + ROBOT_INVERSE[0][1] * heading, width[0], width[2]);
    *u_l = robot_before(ROBOT_INVERSE[1][0] * along + ROBOT_INVERSE[1][1] * heading, width[1], width[3]);
}

#endif
"""
)
