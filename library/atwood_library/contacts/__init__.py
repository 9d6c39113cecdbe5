"""Contact and dry friction: parts that touch, slip, stick and collide."""
