"""The Functional Mock-up Interface (FMI 2.0 and 3.0, https://fmi-standard.org): scenes as FMUs, and FMUs as parts."""
