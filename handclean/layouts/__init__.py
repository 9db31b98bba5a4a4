"""Where to glue few markers: reduced marker layouts (Schroeder 2016, 2017)."""
