"""Events and modes: event functions, time events, sampling."""
