"""Ship hulls and the vessels that carry thrust, rudder and tow."""
