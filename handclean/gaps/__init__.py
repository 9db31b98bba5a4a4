"""Gap filling: joint angles through the frames a marker is hidden."""
