"""Recording of assertions: declare, arrange, state, correct, withdraw."""
