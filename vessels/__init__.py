"""Ship hulls, and vessels with thrust, steering, a tow point and a helmsman."""
