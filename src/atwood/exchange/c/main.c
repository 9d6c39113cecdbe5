/* ./a.out END RTOL OUTPUTS [--set PATH=VALUE ...] [--step H] [--output PATH ...] [--events]: the motion as CSV, with the
 * time and quantities by path.  --set gives parameters other values, which the start is found for.  --events adds a column with what has happened since the row before: kind, source, time, speed of approach. */
#include "scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int number(const char *text, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return end != text && *end == '\0' && *value - *value == 0.0;
}

static int find(const char *path)
{
    int k;
    for (k = 0; k < scene_QUANTITIES; k++) {
        if (strcmp(scene_quantities[k].path, path) == 0) return k;
    }
    return -1;
}

static int set(scene *s, const char *text)
{
    const char *const sign = strchr(text, '=');
    double value;
    int k;
    if (sign == NULL || !number(sign + 1, &value)) return 0;
    for (k = 0; k < scene_PARAMETERS; k++) {
        const char *const path = scene_parameters[k].path;
        if (strlen(path) == (size_t)(sign - text) && strncmp(path, text, strlen(path)) == 0) {
            return scene_set_parameter(s, k, value) == scene_READY;
        }
    }
    return 0;
}

/* Print events from a number on up to a time, and return the number of the next. */
static int print_events(const scene *s, int told, double until)
{
    int k;
    for (k = told > s->happened - scene_LOGGED ? told : s->happened - scene_LOGGED; k < s->happened; k++) {
        const scene_happening *const one = s->log + k % scene_LOGGED;
        if (one->time > until) break;
        printf("%s%s %s %.17g %.17g", k > told ? "; " : "", scene_kinds[one->kind], scene_sources[one->source], one->time,
               one->speed);
    }
    return k;
}

int main(int count, char **given)
{
    static scene s;
    static double values[scene_QUANTITIES + 1];
    static int shown[scene_QUANTITIES + 1];
    double end, rtol, outputs;
    int k, i, chosen = 0, status, told = 0, shows_events = 0;
    if (count < 4 || !number(given[1], &end) || !number(given[2], &rtol) || !number(given[3], &outputs)
        || !(rtol > 0.0) || !(outputs >= 2.0 && outputs <= 1e9)) {
        fprintf(stderr, "usage: %s END RTOL OUTPUTS [--set PATH=VALUE ...] [--step H] [--output PATH ...] [--events]\n", given[0]);
        return 2;
    }
    scene_default(&s);
    s.rtol = rtol;
    for (k = 4; k < count; k += 2) {
        if (strcmp(given[k], "--events") == 0) {
            shows_events = 1;
            k--;
            continue;
        }
        if (k + 1 < count && strcmp(given[k], "--set") == 0) {
            if (set(&s, given[k + 1])) continue;
            fprintf(stderr, "%s: there is no such parameter, or it cannot have this value\n", given[k + 1]);
            return 2;
        }
        if (k + 1 < count && strcmp(given[k], "--step") == 0 && number(given[k + 1], &s.step) && s.step > 0.0) continue;
        if (k + 1 < count && strcmp(given[k], "--output") == 0 && chosen < scene_QUANTITIES) {
            shown[chosen] = find(given[k + 1]);
            if (shown[chosen++] >= 0) continue;
            fprintf(stderr, "%s: there is no such quantity\n", given[k + 1]);
            return 2;
        }
        fprintf(stderr, "%s: this is no option with a value\n", given[k]);
        return 2;
    }
    if (!chosen) {
        for (; chosen < scene_QUANTITIES; chosen++) shown[chosen] = chosen;
    }
    printf("time");
    for (k = 0; k < chosen; k++) printf(",%s", scene_quantities[shown[k]].path);
    printf(shows_events ? ",events\n" : "\n");
    status = scene_begin(&s);
    for (i = 0; i < (int)outputs && status == scene_READY; i++) {
        const double t = scene_start_time + (end - scene_start_time) * i / (outputs - 1.0);
        status = scene_advance(&s, t);
        if (status == scene_READY) status = scene_evaluate(&s, values);
        if (status != scene_READY) break;
        printf("%.17g", s.time);
        for (k = 0; k < chosen; k++) printf(",%.17g", values[shown[k]]);
        if (shows_events) {
            printf(",\"");
            told = print_events(&s, told, i + 1.0 < outputs ? t : HUGE_VAL);
            printf("\"");
        }
        printf("\n");
    }
    if (status != scene_READY) {
        fprintf(stderr, "at t = %.9g s %s\n", s.time, s.text);
        return 1;
    }
    return 0;
}
