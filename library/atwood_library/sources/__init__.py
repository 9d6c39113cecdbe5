"""Sources of the library: functions of time that drive inputs."""
