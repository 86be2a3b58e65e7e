/* rockfall_solver.h: a solver for rockfall in C (protocol 3).
 *
 * Fill in an rf_solver, and return rf_serve(&solver) from main: templates/c/net.c is an example. Units are SI: m, s, kg, N, J.
 * Arrays of fields are [samples][items][components], all of double, the last index the fastest.
 * Made from src/lib.rs by `cargo test`; do not edit. */


#ifndef ROCKFALL_SOLVER_H
#define ROCKFALL_SOLVER_H

#include <stddef.h>
#include <stdint.h>

// A function did what it was asked.
#define RF_OK 0

// The user's input is wrong: the run ends with exit code 2 (in `prepare`; later with 1).
#define RF_INPUT 1

// This window cannot be solved: the coupler tries a shorter one, if the solver repeats.
#define RF_WINDOW 2

// The solver cannot go on: the run ends with exit code 1. So does any other number.
#define RF_BROKEN 3

// One item per node of the interface mesh.
#define RF_NODE 0

// One item per line.
#define RF_LINE 1

// One item per face.
#define RF_FACE 2

// One item for the whole interface.
#define RF_WHOLE 3

// `samples` values, at the ends of as many equal parts of the window; the last is the window's end.
#define RF_AT_ENDS 0

// `samples` + 1 values: the window's start, then as `RF_AT_ENDS`.
#define RF_FROM_START 1

// `samples` means over as many equal parts of the window.
#define RF_MEANS 2

// One value for the window.
#define RF_ONCE 3

// A gauge without a part in the balance of energy.
#define RF_NO_ROLE 0

// Kinetic energy [J].
#define RF_KINETIC 1

// Potential energy of dead load [J].
#define RF_POTENTIAL 2

// Stored (elastic) energy [J].
#define RF_STORED 3

// Energy dissipated since t = 0 [J].
#define RF_DISSIPATED 4

// Work received through the interface since t = 0 [J].
#define RF_RECEIVED 5

// A field of the exchange. Its array is `[samples][items][components]`, the last index the fastest
// (Fortran: `(components, items, samples)`).
typedef struct rf_field {
    // `"force"` [N], `"displacement"` from t = 0 [m], `"velocity"` [m/s], or another name of PROTOCOL.md, section 6.
    const char *name;
    // Numbers per item: 3 for a vector.
    uint32_t components;
    // `RF_NODE`, `RF_LINE`, `RF_FACE` or `RF_WHOLE`.
    uint32_t place;
    // `RF_AT_ENDS`, `RF_FROM_START`, `RF_MEANS` or `RF_ONCE`.
    uint32_t sampling;
    // Declared: the most parts of a window that the solver can do. In a plan: those that travel, 0 if the field does not.
    uint32_t samples;
} rf_field;

// The interface mesh at t = 0. What is `NULL` is empty. A node that no line and no face holds is a contact point of its own.
typedef struct rf_mesh {
    // Number of nodes.
    size_t nodes;
    // `[nodes][3]` [m].
    const double *coordinates;
    // Number of lines (wires, cables, edges).
    size_t lines;
    // `[lines][2]`, nodes from 0.
    const uint32_t *line_nodes;
    // `[lines]` [m]; `NULL`: all zero.
    const double *line_radius;
    // Number of faces.
    size_t faces;
    // `[faces][3]`, nodes from 0.
    const uint32_t *face_nodes;
    // `[nodes]` [kg], infinite where a node is held; `NULL`: not known.
    const double *masses;
} rf_mesh;

// What the run is to be.
typedef struct rf_plan {
    // End of the run [s].
    double end_time;
    // Length of the scene's windows [s]. Single windows may be shorter, or longer up to `largest_window`.
    double window;
    // The solver's `takes`, in its order, each with the samples that travel.
    const struct rf_field *takes;
    // The solver's `gives`, in the same way.
    const struct rf_field *gives;
    // For a contact solver the structure's mesh; for a structure `NULL`.
    const struct rf_mesh *partner;
} rf_plan;

// A named number that comes with every answer. It becomes the column `NAME_UNIT` of history.csv, and with `extremes` the measures
// `NAME_min` and `NAME_max`.
typedef struct rf_gauge {
    // In `snake_case`, without the unit. One in N whose name contains `reaction` is a mean over the window, all others are
    // values at its end.
    const char *name;
    // `"m"`, `"m/s"`, `"N"`, `"J"` or `"1"`.
    const char *unit;
    // `RF_NO_ROLE`, or its part in the balance of energy.
    uint32_t role;
    // 1: its smallest and largest value over the run are results of their own; else 0.
    uint32_t extremes;
} rf_gauge;

// What `prepare` fills in. It is copied when `prepare` returns.
typedef struct rf_ready {
    // A structure offers its mesh here. A contact solver leaves the partner's mesh as it is, or writes its own.
    struct rf_mesh mesh;
    // `[gauge_count]`.
    const struct rf_gauge *gauges;
    // Number of gauges.
    size_t gauge_count;
} rf_ready;

// A time window, as the coupler asks for it.
typedef struct rf_window {
    // Number of the window, from 1.
    uint64_t number;
    // Coupling iteration in the window, from 1.
    uint64_t iteration;
    // Start [s]. Never sum up lengths: this is the time.
    double start;
    // Length [s].
    double length;
} rf_window;

// A solver: what it is, and functions that do its work. Each gets `data`, and returns `RF_OK` or another of these numbers, after
// `rf_explain` with the reason. What is `NULL` where that is allowed is not called.
typedef struct rf_solver {
    // Name and version, for messages.
    const char *program;
    // The solver's own, given to each function.
    void *data;
    // How well it repeats a window: solving A, B, A from one committed state gives both A equal to this share of each field; 0:
    // equal bytes. Below 0: it cannot repeat a window, and is coupled weakly.
    double repeats;
    // Longest window that it can solve [s]; 0: no limit. Eight windows of the scene let clause 5.11 of `PROTOCOL.md` be settled.
    double largest_window;
    // `[take_count]`: what it can take.
    const struct rf_field *takes;
    // Number of these.
    size_t take_count;
    // `[give_count]`: what it can give.
    const struct rf_field *gives;
    // Number of these.
    size_t give_count;
    // Build everything, and fill in `ready`. May take long: call `rf_progress` at least once a second then.
    int (*prepare)(void *data, const struct rf_plan *plan, struct rf_ready *ready);
    // Write the answer as it stands at t = 0: as `solve` does. `NULL`: all of it is zero.
    int (*start)(void *data, double *const *gives, double *gauges);
    // Advance the committed state over the window, into a state that is not committed yet. `takes[i]` and `gives[i]` are the arrays
    // of the declared fields in their order, `NULL` for one that the plan does not have; write every number of `gives`.
    // `gauges` is `[gauge_count][3]`: value, smallest and largest over the solver's own steps. May be called any number of
    // times for a window, always from the committed state: equal input gives equal numbers. The arrays are valid in this call alone.
    int (*solve)(void *data,
                 const struct rf_window *window,
                 const double *const *takes,
                 double *const *gives,
                 double *gauges);
    // Accept the last solve: its end is the committed state from now on.
    int (*commit)(void *data);
    // The run is over: write files, call `rf_measure`. May be `NULL`.
    int (*finish)(void *data);
    // 1: nothing of it will move any more unless the other solver moves it; else 0. May be `NULL`.
    int (*at_rest)(void *data);
    // The committed state as bytes, valid until the next call, from which `resume` can go on in another run. Both or none: with them
    // a run that was killed goes on.
    int (*save)(void *data, const uint8_t **bytes, size_t *length);
    // Before `prepare`, which then gives the same answers as at t = 0 but leaves the solver in this state.
    int (*resume)(void *data, const uint8_t *bytes, size_t length);
} rf_solver;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Take part in the run that this program's own command line names; returns its exit code. Ends when the run does.
// All pointers in `solver` are valid until it returns.
int rf_serve(const struct rf_solver *solver);

// The reason for what a function is about to return, for the user: what, where, the numbers, what to try.
// `reason` is a text that ends with a zero, or `NULL`.
void rf_explain(const char *reason);

// Say how far `prepare` is, with the share that is done (0 to 1). Other than 0: the run ends, return this number at once.
// `what` is a text that ends with a zero, or `NULL`.
int rf_progress(const char *what,
                double done);

// In `finish`: a result of the whole run, for summary.json. Its name is in `snake_case`, without the unit.
// `name` and `unit` are texts that end with a zero.
void rf_measure(const char *name, double value, const char *unit);

// A number of the scene by its dotted key, as `"rock.0.mass"` or `"custom.stiffness"`; `otherwise` where the scene does not have
// it. What is there and no number ends the run with a message. The table `[custom]` of a scene belongs to programs like yours.
// `key` is a text that ends with a zero.
double rf_number(const char *key,
                 double otherwise);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ROCKFALL_SOLVER_H */
