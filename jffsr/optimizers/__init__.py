"""One interface, one driver, and the optimizers: swarms, evolution, gradients, and these combined."""
