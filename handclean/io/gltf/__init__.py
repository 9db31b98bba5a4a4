"""Binary glTF (.glb): hands with skin, in by any program, out with their motion."""
