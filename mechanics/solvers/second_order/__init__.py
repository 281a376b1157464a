"""Second-order solvers: Newton, interior point and cone programs."""
