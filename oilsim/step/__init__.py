"""The arrays, context, lists of neighbours and sleeping regions that the stages of a step share."""
