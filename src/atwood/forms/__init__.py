"""Forms: residuals of both forms as programs, and the assembled scene."""
