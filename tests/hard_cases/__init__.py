"""Problems on which simulations of mechanisms fail, with what is asked of each and what each form reaches."""
