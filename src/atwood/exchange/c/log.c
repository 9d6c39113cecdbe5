static void log_event(scene *s, double time, int source, int kind, double speed)
{
    scene_happening *const one = s->log + s->happened % scene_LOGGED;
    one->time = time;
    one->speed = speed;
    one->source = source;
    one->kind = kind;
    s->happened++;
}
