"""The experiments of Schroecker & Weber (2014), section 7."""
