"""Cases with tension of interfaces: between liquids, and between water and air."""
