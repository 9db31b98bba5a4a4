"""Gaussian process regression: exact, and sparse with pseudo-inputs.

``kernels`` sums of named covariance terms and their derivatives; ``means`` the linear
mean in closed form; ``exact`` and ``sparse`` the evidence and the prediction;
``descent`` the optimizer; ``train`` and ``train_sparse`` from samples to
hyperparameters, which are logarithms throughout. Numbers are expected scaled
(``scaling``): inputs and targets of mean 0 and deviation 1.
"""
