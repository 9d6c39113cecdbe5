"""Speed against error: both forms beside each other."""
