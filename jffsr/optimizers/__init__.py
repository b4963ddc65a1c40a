"""One interface, one driver, and the optimizers: QPSO, gradients, and the two in a row."""
