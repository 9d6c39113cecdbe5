/* Functions that are the same in both versions of the interface; F names one of them, of type `status`. */

EXPORT void F(FreeInstance)(handle o) { free(o); }
EXPORT status F(Terminate)(handle o) { (void)o; return OK; }
EXPORT status F(Reset)(handle o) { reset_instance((instance *)o); return OK; }
EXPORT status F(ExitInitializationMode)(handle o) { return done(begin_motion((instance *)o)); }

EXPORT status F(GetFMUState)(handle o, void **kept)
{
    if (*kept == NULL) *kept = calloc(1, sizeof(instance));
    if (*kept == NULL) return ERROR;
    copy_instance((instance *)*kept, (instance *)o);
    return OK;
}

EXPORT status F(SetFMUState)(handle o, void *kept)
{
    if (kept == NULL) return ERROR;
    copy_instance((instance *)o, (instance *)kept);
    return OK;
}

EXPORT status F(FreeFMUState)(handle o, void **kept)
{
    (void)o;
    free(*kept);
    *kept = NULL;
    return OK;
}

EXPORT status F(SerializedFMUStateSize)(handle o, void *kept, size_t *size)
{
    (void)o; (void)kept;
    *size = sizeof(instance);
    return OK;
}

EXPORT status F(SerializeFMUState)(handle o, void *kept, byte bytes[], size_t size)
{
    (void)o;
    if (size != sizeof(instance)) return ERROR;
    memcpy(bytes, kept, size);
    return OK;
}

EXPORT status F(DeserializeFMUState)(handle o, const byte bytes[], size_t size, void **kept)
{
    (void)o;
    if (size != sizeof(instance)) return ERROR;
    if (*kept == NULL) *kept = calloc(1, sizeof(instance));
    if (*kept == NULL) return ERROR;
    memcpy(*kept, bytes, size);
    forget_addresses((instance *)*kept);
    return OK;
}

EXPORT status F(EnterContinuousTimeMode)(handle o) { (void)o; return EXCHANGES ? OK : ERROR; }

EXPORT status F(SetTime)(handle o, double time)
{
    if (!EXCHANGES) return ERROR;
    take_time((instance *)o, time);
    return OK;
}

EXPORT status F(SetContinuousStates)(handle o, const double x[], size_t n)
{
    if (!EXCHANGES || n != SIZE) return ERROR;
    memcpy(((instance *)o)->s.state, x, n * sizeof(double));
    ((instance *)o)->is_read = 0;
    return OK;
}

EXPORT status F(GetContinuousStates)(handle o, double x[], size_t n)
{
    if (!EXCHANGES || n != SIZE) return ERROR;
    memcpy(x, ((instance *)o)->s.state, n * sizeof(double));
    return OK;
}

EXPORT status F(GetContinuousStateDerivatives)(handle o, double x[], size_t n)
{
    if (!EXCHANGES || n != SIZE || !read_values((instance *)o)) return ERROR;
    memcpy(x, ((instance *)o)->rates, n * sizeof(double));
    return OK;
}

EXPORT status F(GetEventIndicators)(handle o, double x[], size_t n)
{
    return EXCHANGES && n == EVENTS ? done(indicators((instance *)o, x)) : ERROR;
}

EXPORT status F(GetNominalsOfContinuousStates)(handle o, double x[], size_t n)
{
    (void)o;
    if (!EXCHANGES || n != SIZE) return ERROR;
    take_nominals(x);
    return OK;
}
