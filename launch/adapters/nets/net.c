/* A net of cables and trusses as the structure of a run, read from what `rockfall export` writes of a scene.
 *
 * usage: net MODELLED.mdpa REST.mdpa ...   (both files are of one scene, the second is written with --at-rest)
 *
 * Position Verlet in steps of `fem.time_step` of the scene at most, with its `structure.damping`; it repeats a window to equal bytes. */
#include <math.h>
#include <rockfall_solver.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef double Vector[3];

typedef struct {
    double young, area, density, prestress; /* [Pa], [m2], [kg/m3], second Piola-Kirchhoff stress as modelled [Pa] */
} Section;

typedef struct {
    Vector *x, *v;  /* places [m], velocities [m/s] */
    double largest; /* reaction so far [N] */
} State;

typedef struct {
    const char *files[2];
    size_t nodes, lines, shown; /* `shown`: the node of the gauge */
    Vector *modelled, *rest, *gravity, *middle, *force;
    int (*held)[3];
    uint32_t (*ends)[2], *section_of;
    Section *sections;
    double *square, *pull, *slope, *least, *mass, *masses, *radius;
    double step, damping;
    State committed, trial;
} Net;

static int refuse(const char *form, ...) {
    char text[512];
    va_list values;
    va_start(values, form);
    vsnprintf(text, sizeof text, form, values);
    va_end(values);
    rf_explain(text);
    return RF_INPUT;
}

/* Lines of a file, more than it has nodes or elements; 0 where it cannot be read. */
static size_t count(const char *name) {
    FILE *file = fopen(name, "r");
    size_t lines = 0;
    for (int c; file && (c = getc(file)) != EOF;) lines += c == '\n';
    if (file) fclose(file);
    return lines;
}

/* Read an .mdpa file, places of its nodes into `place`. */
static int read(Net *net, const char *name, Vector *place) {
    FILE *file = fopen(name, "r");
    char line[512], kind[64] = "", what[64] = "";
    size_t rows = 0;
    net->nodes = net->lines = 0;
    while (fgets(line, sizeof line, file)) {
        unsigned id, section, a, b;
        double value, at[3];
        if (sscanf(line, "Begin %63s %63s", kind, what) > 0) {
            rows = 0;
            if (!strcmp(kind, "Elements") && strcmp(what, "CableElement3D2N") && strcmp(what, "TrussElement3D2N"))
                return refuse("%s: %s: cables and trusses alone are computed", name, what);
        } else if (!strncmp(line, "End ", 4)) {
            kind[0] = 0;
        } else if (!strcmp(kind, "Properties") && sscanf(line, "%*s %lf", &value) == 1) {
            Section *of = &net->sections[atoi(what)];
            if (!strncmp(line, "YOUNG_MODULUS ", 14)) of->young = value;
            if (!strncmp(line, "CROSS_AREA ", 11)) of->area = value;
            if (!strncmp(line, "DENSITY ", 8)) of->density = value;
            if (!strncmp(line, "TRUSS_PRESTRESS_PK2 ", 20)) of->prestress = value;
        } else if (!strcmp(kind, "Nodes") && sscanf(line, "%u %lf %lf %lf", &id, at, at + 1, at + 2) == 4) {
            if (id != ++rows) return refuse("%s: node %u in row %zu: they must count from 1", name, id, rows);
            memcpy(place[net->nodes++], at, sizeof at);
        } else if (!strcmp(kind, "Elements") && sscanf(line, "%u %u %u %u", &id, &section, &a, &b) == 4) {
            net->ends[net->lines][0] = a - 1, net->ends[net->lines][1] = b - 1;
            net->least[net->lines] = what[0] == 'C' ? 0.0 : -INFINITY;
            net->section_of[net->lines++] = section;
        } else if (!strcmp(kind, "NodalData") && sscanf(line, "%u %*d %lf", &id, &value) == 2) {
            int c = what[strlen(what) - 1] - 'X';
            if (what[0] == 'D') net->held[id - 1][c] = 1;
            if (what[0] == 'V') net->gravity[id - 1][c] = value;
        }
    }
    fclose(file);
    return RF_OK;
}

/* Force of elements and weight on each node at the places `x`, into `net->force` [N]. */
static void forces(const Net *net, Vector *x) {
    Vector *f = net->force;
    for (size_t n = 0; n < net->nodes; n++)
        for (int k = 0; k < 3; k++) f[n][k] = net->mass[n] * net->gravity[n][k];
    for (size_t i = 0; i < net->lines; i++) {
        uint32_t a = net->ends[i][0], b = net->ends[i][1];
        Vector d = {x[b][0] - x[a][0], x[b][1] - x[a][1], x[b][2] - x[a][2]};
        double pull = net->pull[i] + net->slope[i] * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - net->square[i]);
        pull = fmax(pull, net->least[i]);
        for (int k = 0; k < 3; k++) f[a][k] += pull * d[k], f[b][k] -= pull * d[k];
    }
}

/* The force of all supports on the structure [N]. */
static void support(const Net *net, double sum[3]) {
    sum[0] = sum[1] = sum[2] = 0.0;
    for (size_t n = 0; n < net->nodes; n++)
        for (int k = 0; k < 3; k++) sum[k] -= net->held[n][k] ? net->force[n][k] : 0.0;
}

static int prepare(void *data, const rf_plan *plan, rf_ready *ready) {
    (void)plan;
    Net *net = data;
    size_t rows = 1;
    for (int i = 0; i < 2; i++) {
        size_t found = net->files[i] ? count(net->files[i]) : 0;
        if (!found) return refuse("usage: net MODELLED.mdpa REST.mdpa (rockfall export); cannot be read: %s", net->files[i] ? net->files[i] : "-");
        rows += found;
    }
#define MAKE(array) (array = calloc(rows, sizeof *array))
    if (!(MAKE(net->modelled) && MAKE(net->rest) && MAKE(net->gravity) && MAKE(net->middle) && MAKE(net->force) && MAKE(net->held) &&
          MAKE(net->ends) && MAKE(net->section_of) && MAKE(net->sections) && MAKE(net->square) && MAKE(net->pull) &&
          MAKE(net->slope) && MAKE(net->least) && MAKE(net->mass) && MAKE(net->masses) && MAKE(net->radius) &&
          MAKE(net->committed.x) && MAKE(net->committed.v) && MAKE(net->trial.x) && MAKE(net->trial.v)))
        return RF_BROKEN;
    int code = read(net, net->files[1], net->rest);
    if (code == RF_OK) code = read(net, net->files[0], net->modelled);
    if (code != RF_OK) return code;
    net->step = rf_number("fem.time_step", 0.0);
    net->damping = rf_number("structure.damping", 0.0);
    if (!(net->step > 0.0)) return refuse("fem.time_step: the net needs one, below 2 / w (`rockfall check` prints it)");

    for (size_t i = 0; i < net->lines; i++) {
        const Section *of = &net->sections[net->section_of[i]];
        const double *a = net->modelled[net->ends[i][0]], *b = net->modelled[net->ends[i][1]];
        double square = 0.0;
        for (int k = 0; k < 3; k++) square += (b[k] - a[k]) * (b[k] - a[k]);
        double length = sqrt(square);
        /* Pull per length: S A / L with S = prestress + E e, and the Green-Lagrange strain e = (l^2 - L^2) / (2 L^2). */
        net->square[i] = square;
        net->pull[i] = of->prestress * of->area / length;
        net->slope[i] = of->young * of->area / (2.0 * length * square);
        for (int end = 0; end < 2; end++) net->mass[net->ends[i][end]] += 0.5 * of->density * of->area * length;
        net->radius[i] = rf_number("structure.cable.radius", 0.0);
    }
    const double shown[] = {rf_number("gauge.0.at.0", 0.0), rf_number("gauge.0.at.1", 0.0), rf_number("gauge.0.at.2", 0.0)};
    double nearest = INFINITY;
    for (size_t n = 0; n < net->nodes; n++) {
        const double *x = net->rest[n];
        double far = hypot(hypot(x[0] - shown[0], x[1] - shown[1]), x[2] - shown[2]);
        if (far < nearest) nearest = far, net->shown = n;
        net->masses[n] = net->held[n][0] && net->held[n][1] && net->held[n][2] ? INFINITY : net->mass[n];
    }
    memcpy(net->committed.x, net->rest, net->nodes * sizeof *net->rest);
    static const rf_gauge gauges[] = {{"reaction_x", "N", RF_NO_ROLE, 0}, {"reaction_y", "N", RF_NO_ROLE, 0},
                                      {"reaction_z", "N", RF_NO_ROLE, 0}, {"centre_uz", "m", RF_NO_ROLE, 1}};
    ready->mesh = (rf_mesh){net->nodes, net->rest[0], net->lines, net->ends[0], net->radius, 0, NULL, net->masses};
    ready->gauges = gauges;
    ready->gauge_count = 4;
    return RF_OK;
}

static int start(void *data, double *const *gives, double *gauges) {
    (void)gives;
    Net *net = data;
    Vector sum;
    forces(net, net->rest);
    support(net, sum);
    for (int i = 0; i < 9; i++) gauges[i] = sum[i / 3];
    return RF_OK;
}

static void record(double gauge[3], double value, double so_far) {
    gauge[0] = so_far;
    gauge[1] = fmin(gauge[1], value);
    gauge[2] = fmax(gauge[2], value);
}

static int solve(void *data, const rf_window *window, const double *const *takes, double *const *gives, double *gauges) {
    Net *net = data;
    State *state = &net->trial;
    size_t size = net->nodes * sizeof *state->x;
    memcpy(state->x, net->committed.x, size);
    memcpy(state->v, net->committed.v, size);
    state->largest = net->committed.largest;
    int steps = (int)fmax(ceil(window->length / net->step * (1.0 - 1e-9)), 1.0);
    double h = window->length / steps, c = 0.5 * h * net->damping;
    for (int i = 0; i < 4; i++) gauges[3 * i] = 0.0, gauges[3 * i + 1] = INFINITY, gauges[3 * i + 2] = -INFINITY;
    for (int step = 0; step < steps; step++) {
        for (size_t n = 0; n < net->nodes; n++)
            for (int k = 0; k < 3; k++) net->middle[n][k] = state->x[n][k] + 0.5 * h * state->v[n][k];
        forces(net, net->middle);
        for (size_t n = 0; n < net->nodes; n++)
            for (int k = 0; k < 3; k++) {
                double *v = &state->v[n][k];
                net->force[n][k] += takes[0][3 * n + k];
                *v = net->held[n][k] ? 0.0 : ((1.0 - c) * *v + h * net->force[n][k] / net->mass[n]) / (1.0 + c);
                state->x[n][k] = net->middle[n][k] + 0.5 * h * *v;
            }
        Vector sum;
        support(net, sum);
        state->largest = fmax(state->largest, sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]));
        for (int k = 0; k < 3; k++) record(gauges + 3 * k, sum[k], gauges[3 * k] + sum[k] / steps);
        double deflection = state->x[net->shown][2] - net->rest[net->shown][2];
        record(gauges + 9, deflection, deflection);
    }
    for (size_t n = 0; n < net->nodes; n++)
        for (int k = 0; k < 3; k++) gives[0][3 * n + k] = state->x[n][k] - net->rest[n][k];
    memcpy(gives[1], state->v, size);
    return RF_OK;
}

static int commit(void *data) {
    Net *net = data;
    State was = net->committed;
    net->committed = net->trial;
    net->trial = was;
    return RF_OK;
}

static int finish(void *data) {
    rf_measure("max_reaction", ((Net *)data)->committed.largest, "N");
    return RF_OK;
}

int main(int argc, char **argv) {
    static Net net;
    for (int i = 0; i < 2 && i + 1 < argc; i++) net.files[i] = argv[i + 1];
    static const rf_field takes[] = {{"force", 3, RF_NODE, RF_MEANS, 1}};
    static const rf_field gives[] = {{"displacement", 3, RF_NODE, RF_AT_ENDS, 1}, {"velocity", 3, RF_NODE, RF_AT_ENDS, 1}};
    rf_solver solver = {.program = "net of cables (C)", .data = &net, .takes = takes, .take_count = 1, .gives = gives, .give_count = 2,
                        .prepare = prepare, .start = start, .solve = solve, .commit = commit, .finish = finish};
    return rf_serve(&solver);
}
