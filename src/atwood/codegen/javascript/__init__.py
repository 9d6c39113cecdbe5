"""Programs and routines as JavaScript, for pages that compute a motion themselves."""
