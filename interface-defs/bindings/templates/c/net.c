/* A net of masses and springs as the structure of a run.
 *
 * 7 x 7 nodes, the edge held; position Verlet, steps of 0.1 ms at most; it repeats a window to equal bytes. */
#include <math.h>
#include <rockfall_solver.h>
#include <string.h>

enum { SIDE = 7, NODES = SIDE * SIDE, CENTRE = NODES / 2, SPRINGS = 2 * SIDE * (SIDE - 1) };
static const double SPACING = 0.5;    /* [m] */
static const double REST = 0.49;      /* length of a spring without force [m] */
static const double MASS = 1.0;       /* of a node [kg] */
static const double STIFFNESS = 5e4;  /* of a spring [N/m] */
static const double STEP = 1e-4;      /* the longest [s] */

typedef struct {
    double u[NODES][3];  /* displacement from t = 0 [m] */
    double v[NODES][3];  /* velocity [m/s] */
} State;

typedef struct {
    double x[NODES][3], mass[NODES], radius[SPRINGS];
    uint32_t spring[SPRINGS][2];
    State committed, trial;
} Net;

/* Add the forces of all springs [N]. */
static void add_forces(const Net *net, double u[NODES][3], double f[NODES][3]) {
    for (int s = 0; s < SPRINGS; s++) {
        uint32_t a = net->spring[s][0], b = net->spring[s][1];
        double d[3];
        for (int k = 0; k < 3; k++) d[k] = (net->x[b][k] + u[b][k]) - (net->x[a][k] + u[a][k]);
        double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        double pull = STIFFNESS * (length - REST) / length;
        for (int k = 0; k < 3; k++) {
            f[a][k] += pull * d[k];
            f[b][k] -= pull * d[k];
        }
    }
}

static int prepare(void *data, const rf_plan *plan, rf_ready *ready) {
    (void)plan;
    Net *net = data;
    int s = 0;
    for (int n = 0; n < NODES; n++) {
        int i = n % SIDE, j = n / SIDE;
        net->x[n][0] = SPACING * (i - 3);
        net->x[n][1] = SPACING * (j - 3);
        net->mass[n] = i == 0 || j == 0 || i == SIDE - 1 || j == SIDE - 1 ? INFINITY : MASS;
        if (i + 1 < SIDE) net->spring[s][0] = n, net->spring[s++][1] = n + 1;
        if (j + 1 < SIDE) net->spring[s][0] = n, net->spring[s++][1] = n + SIDE;
    }
    for (s = 0; s < SPRINGS; s++) net->radius[s] = 0.01;
    static const rf_gauge gauges[] = {{"centre_uz", "m", RF_NO_ROLE, 1}, {"reaction_z", "N", RF_NO_ROLE, 1}};
    ready->mesh = (rf_mesh){NODES, net->x[0], SPRINGS, net->spring[0], net->radius, 0, NULL, net->mass};
    ready->gauges = gauges;
    ready->gauge_count = 2;
    return RF_OK;
}

static void record(double gauge[3], double value, double sum) {
    gauge[0] = sum;
    gauge[1] = fmin(gauge[1], value);
    gauge[2] = fmax(gauge[2], value);
}

static int solve(void *data, const rf_window *window, const double *const *takes, double *const *gives,
                 double *gauges) {
    Net *net = data;
    State *state = &net->trial;
    *state = net->committed;
    const double(*load)[3] = (const double(*)[3])takes[0];
    int steps = (int)fmax(ceil(window->length / STEP * (1.0 - 1e-9)), 1.0);
    double h = window->length / steps;
    gauges[0] = gauges[3] = 0.0;
    gauges[1] = gauges[4] = INFINITY;
    gauges[2] = gauges[5] = -INFINITY;
    for (int step = 0; step < steps; step++) {
        double f[NODES][3] = {{0.0}}, support = 0.0;
        for (int n = 0; n < NODES; n++)
            for (int k = 0; k < 3; k++) state->u[n][k] += 0.5 * h * state->v[n][k];
        add_forces(net, state->u, f);
        for (int n = 0; n < NODES; n++) {
            if (isinf(net->mass[n])) {
                support -= f[n][2] + load[n][2];
                continue;
            }
            for (int k = 0; k < 3; k++) {
                state->v[n][k] += h * (f[n][k] + load[n][k]) / MASS;
                state->u[n][k] += 0.5 * h * state->v[n][k];
            }
        }
        record(gauges, state->u[CENTRE][2], state->u[CENTRE][2]);
        record(gauges + 3, support, gauges[3] + support / steps);
    }
    memcpy(gives[0], state->u, sizeof state->u);
    memcpy(gives[1], state->v, sizeof state->v);
    return RF_OK;
}

static int commit(void *data) {
    Net *net = data;
    net->committed = net->trial;
    return RF_OK;
}

int main(void) {
    static Net net;
    static const rf_field takes[] = {{"force", 3, RF_NODE, RF_MEANS, 1}};
    static const rf_field gives[] = {{"displacement", 3, RF_NODE, RF_AT_ENDS, 1},
                                     {"velocity", 3, RF_NODE, RF_AT_ENDS, 1}};
    rf_solver solver = {.program = "net (C)", .data = &net, .repeats = 0.0, .largest_window = 1e-3,
                        .takes = takes, .take_count = 1, .gives = gives, .give_count = 2,
                        .prepare = prepare, .solve = solve, .commit = commit};
    return rf_serve(&solver);
}
