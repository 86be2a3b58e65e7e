/* A sphere that falls on nodes as the contact solver of a run: a penalty force where it overlaps one.
 *
 * Mass, radius, start and gravity are those of the scene's first rock; position Verlet, steps of 20 us at most. */
#include <math.h>
#include <rockfall_solver.h>
#include <stdlib.h>

static const double STEP = 2e-5; /* the longest [s] */

typedef struct {
    double x[3], v[3]; /* centre [m], velocity [m/s] */
} State;

typedef struct {
    double mass, radius, stiffness, gravity[3];
    const double *nodes; /* [count][3], at t = 0 [m] */
    size_t count;
    State committed, trial;
} Sphere;

static int prepare(void *data, const rf_plan *plan, rf_ready *ready) {
    Sphere *sphere = data;
    static const char *position[] = {"rock.0.position.0", "rock.0.position.1", "rock.0.position.2"};
    static const char *velocity[] = {"rock.0.velocity.0", "rock.0.velocity.1", "rock.0.velocity.2"};
    static const char *gravity[] = {"gravity.0", "gravity.1", "gravity.2"};
    static const rf_gauge gauges[] = {{"sphere_z", "m", RF_NO_ROLE, 1}, {"sphere_vz", "m/s", RF_NO_ROLE, 1}};
    if (plan->partner == NULL) {
        rf_explain("a sphere needs a net to fall on: give the scene a [structure]");
        return RF_INPUT;
    }
    sphere->mass = rf_number("rock.0.mass", 50.0);
    sphere->radius = rf_number("rock.0.shape.radius", 0.2);
    sphere->stiffness = rf_number("custom.penalty", 2e5); /* [N/m] */
    for (int k = 0; k < 3; k++) {
        sphere->committed.x[k] = rf_number(position[k], 0.0);
        sphere->committed.v[k] = rf_number(velocity[k], 0.0);
        sphere->gravity[k] = rf_number(gravity[k], 0.0);
    }
    /* The partner's mesh is copied: it is valid in this call alone. */
    sphere->count = plan->partner->nodes;
    double *nodes = malloc(3 * sphere->count * sizeof *nodes);
    if (nodes == NULL) return RF_BROKEN;
    for (size_t i = 0; i < 3 * sphere->count; i++) nodes[i] = plan->partner->coordinates[i];
    sphere->nodes = nodes;
    ready->gauges = gauges;
    ready->gauge_count = 2;
    return RF_OK;
}

static void record(double gauge[3], double value) {
    gauge[0] = value;
    gauge[1] = fmin(gauge[1], value);
    gauge[2] = fmax(gauge[2], value);
}

static int start(void *data, double *const *gives, double *gauges) {
    (void)gives; /* nothing touches at t = 0: all forces stay zero */
    const State *state = &((Sphere *)data)->committed;
    for (int i = 0; i < 3; i++) gauges[i] = state->x[2], gauges[3 + i] = state->v[2];
    return RF_OK;
}

/* Force on each node of a sphere at x, of nodes a share of the window after its start; returns nothing, adds to `sum`. */
static void forces(const Sphere *sphere, const double x[3], const double *displacement, double share,
                   double *f, double sum[3]) {
    size_t n = 3 * sphere->count;
    sum[0] = sum[1] = sum[2] = 0.0;
    for (size_t i = 0; i < n; i += 3) {
        double d[3];
        for (int k = 0; k < 3; k++) {
            double from = displacement[i + k], to = displacement[n + i + k];
            d[k] = sphere->nodes[i + k] + (from + share * (to - from)) - x[k];
        }
        double distance = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        double overlap = sphere->radius - distance;
        double push = overlap > 0.0 && distance > 0.0 ? sphere->stiffness * overlap / distance : 0.0;
        for (int k = 0; k < 3; k++) {
            f[i + k] = push * d[k];
            sum[k] += push * d[k];
        }
    }
}

static int solve(void *data, const rf_window *window, const double *const *takes, double *const *gives,
                 double *gauges) {
    Sphere *sphere = data;
    State *state = &sphere->trial;
    *state = sphere->committed;
    size_t n = 3 * sphere->count;
    int steps = (int)fmax(ceil(window->length / STEP * (1.0 - 1e-9)), 1.0);
    double h = window->length / steps;
    double *mean = gives[0], *end = gives[1]; /* the plan has one of these, or both */
    double *f = malloc(n * sizeof *f), sum[3];
    if (f == NULL) return RF_BROKEN;
    if (mean) for (size_t i = 0; i < n; i++) mean[i] = 0.0;
    gauges[1] = gauges[4] = INFINITY;
    gauges[2] = gauges[5] = -INFINITY;
    for (int step = 0; step < steps; step++) {
        for (int k = 0; k < 3; k++) state->x[k] += 0.5 * h * state->v[k];
        forces(sphere, state->x, takes[0], (step + 0.5) / steps, f, sum);
        for (int k = 0; k < 3; k++) {
            state->v[k] += h * (sphere->gravity[k] - sum[k] / sphere->mass);
            state->x[k] += 0.5 * h * state->v[k];
        }
        if (mean) for (size_t i = 0; i < n; i++) mean[i] += f[i] / steps;
        record(gauges, state->x[2]);
        record(gauges + 3, state->v[2]);
    }
    if (end) forces(sphere, state->x, takes[0], 1.0, end, sum);
    free(f);
    return RF_OK;
}

static int commit(void *data) {
    Sphere *sphere = data;
    sphere->committed = sphere->trial;
    return RF_OK;
}

int main(void) {
    static Sphere sphere;
    static const rf_field takes[] = {{"displacement", 3, RF_NODE, RF_FROM_START, 1}};
    static const rf_field gives[] = {{"force", 3, RF_NODE, RF_MEANS, 1}, {"force", 3, RF_NODE, RF_AT_ENDS, 1}};
    rf_solver solver = {.program = "sphere (C)", .data = &sphere, .repeats = 0.0,
                        .takes = takes, .take_count = 1, .gives = gives, .give_count = 2,
                        .prepare = prepare, .start = start, .solve = solve, .commit = commit};
    return rf_serve(&solver);
}
