static void log_event(scene *s, double time, int source, int kind, double speed)
{
    int k = s->happened, least = k < scene_LOGGED ? 0 : k - scene_LOGGED + 1;
    scene_happening *one;
    for (; k > least && s->log[(k - 1) % scene_LOGGED].time > time; k--) { /* a rest is told ahead of its time */
        s->log[k % scene_LOGGED] = s->log[(k - 1) % scene_LOGGED];
    }
    one = s->log + k % scene_LOGGED;
    one->time = time;
    one->speed = speed;
    one->source = source;
    one->kind = kind;
    s->happened++;
}
