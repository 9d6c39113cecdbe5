/* scene: the state of a motion, and what can be asked of it.
 *
 *     scene s;
 *     scene_default(&s);               values and start of the scene
 *     scene_set_parameter(&s, k, 2.0);
 *     scene_begin(&s);                 from s.time and s.state, after any change of them or of a parameter
 *     scene_advance(&s, 1.5);          to a time, s
 *     scene_evaluate(&s, values);      quantities there
 *
 * Nothing is allocated; an instance is one struct, which scene_copy copies. All numbers are in SI units.
 */
#ifndef scene_H
#define scene_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* counts */

/* How a function returns; s.text says why. */
enum { scene_READY, scene_STOPPED, scene_FAILED, scene_AT_SINGULARITY, scene_REFUSED };

/* word */
typedef struct {
    const char *path, *unit;
} scene_variable;

typedef struct {
    const char *path, *unit;
    double value, low, high;
} scene_parameter_of;

/* What happened: when, the source of it, its kind, and the speed of approach of an impact. */
typedef struct {
    double time, speed;
    int source, kind;
} scene_happening;

typedef struct scene {
    /* To be set before scene_begin: tolerances (atol is taken as rtol where it is 0), the longest step, or, if step
     * is above 0, the length of all steps, whose error nothing then controls. */
    double rtol, atol, longest, step;
    /* The time, s, and coordinates and speeds. */
    double time;
    double state[scene_STATES];
    /* How the last call returned, and why. */
    int status;
    const char *text;
    /* How much has happened, and the last of it in the order of time: number k is in log[k % scene_LOGGED]. That
     * impacts come to an end is told before they do: what happens until then gets the number of that event. */
    int happened;
    scene_happening log[scene_LOGGED];
    /* The last event of a part, its time, and the constraint that a failure or a singular position names. */
    int event, constraint;
    double event_time;
    /* What the engine remembers. */
    double began, searched, coming, found, changed;
    int coming_kind, is_evaluated, is_new, changes, side, leads, hits;
    /* memory */
} scene;

extern const double scene_start_time, scene_end_time;
extern const scene_variable scene_states[], scene_quantities[];
extern const scene_parameter_of scene_parameters[];
extern const char *const scene_sources[], *const scene_kinds[];

void scene_default(scene *s);
int scene_begin(scene *s);
int scene_advance(scene *s, double time);
int scene_evaluate(scene *s, double *quantities);
int scene_rates(scene *s, double *rates);
void scene_energies(scene *s, double *kinetic, double *potential);
double scene_parameter(const scene *s, int number);
int scene_set_parameter(scene *s, int number, double value);
void scene_copy(scene *target, const scene *source);

#ifdef __cplusplus
}
#endif
#endif
