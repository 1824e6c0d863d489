"""All joint positions of a general arm of six joints, by elimination."""
