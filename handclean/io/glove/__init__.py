"""Files of a glove's readings and of the joint angles made of them."""
