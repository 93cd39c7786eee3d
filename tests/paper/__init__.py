"""The figures and conclusions of Qiu et al. 2021, drawn and measured again: `make paper`."""
