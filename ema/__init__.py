"""Fault identification for electromechanical actuators: the library."""
