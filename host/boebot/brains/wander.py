"""Wander about, and keep out of the way of things.

Wandering follows code listings 5.1 and 5.2 of the notes: drive straight on; now and then, by chance, turn on
the spot for a while. Whiskers and infra-red come on top: a touched whisker makes the robot back off and turn
away, something seen by infra-red makes it turn until the way is clear.

The notes' robot runs 0.68 m/s and begins to turn with probability 0.01 in a hundredth of a second: after
0.7 m on average. A Boe-Bot runs 0.14 m/s; with 0.002 it drives as far before it turns.
"""

from boebot import Robot

NEEDS = ["infrared"]  # whiskers where the robot has them

FORWARD = 0.5  # motor signal straight ahead
TURN = 0.7  # motor signal of turning on the spot
TURN_CHANCE = 0.002  # in each hundredth of a second: begin to turn
STOP_TURN_CHANCE = 0.03  # and, when turning, stop it
LEFT_CHANCE = 0.5  # turn left rather than right

AVOID_TURN = 0.5  # motor signal of turning away from what infra-red sees
CLEAR_TIME = 0.2  # s to turn on after infra-red sees nothing any more
KEEP_SIDE_TIME = 1.5  # s in which it turns to the same side again: in a corner it would dither
BACK_TIME = 0.5  # s to back off after a touch
ESCAPE_TIME = 0.6  # s to turn away after backing off: about 110 degrees


class Brain:
    """States: "straight" and "turn" wander, "avoid" heeds infra-red, "back" and "escape" follow a touch."""

    def __init__(self) -> None:
        self.whiskers: bool | None = None  # does the robot have them?
        self.state = "straight"
        self.left = False  # which way it turns
        self.keep_side_until = 0.0
        self.until = 0.0  # when the present state ends (s)

    def step(self, robot: Robot) -> None:
        touched_left = touched_right = False
        if self.whiskers is None:
            self.whiskers = robot.has("whiskers")
        if self.whiskers:
            touched_left, touched_right = robot.whisker_left.pressed, robot.whisker_right.pressed
        seen_left, seen_right = robot.infrared_left.detected, robot.infrared_right.detected

        if touched_left or touched_right:
            self.state = "back"
            self.until = robot.time + BACK_TIME
            self.choose_side(robot, touched_left, touched_right)
        elif (seen_left or seen_right) and self.state in ("straight", "turn"):
            self.state = "avoid"
            if robot.time >= self.keep_side_until:
                self.choose_side(robot, seen_left, seen_right)

        if self.state == "straight":
            robot.drive(FORWARD, FORWARD)
            if robot.chance(TURN_CHANCE, per=0.01):
                self.left = robot.chance(LEFT_CHANCE)
                self.state = "turn"

        elif self.state == "turn":
            self.turn(robot, TURN, -TURN)
            if robot.chance(STOP_TURN_CHANCE, per=0.01):
                self.state = "straight"

        elif self.state == "avoid":
            if seen_left and seen_right:  # ahead: turn on the spot
                self.turn(robot, AVOID_TURN, -AVOID_TURN)
            else:  # to one side: turn about the wheel on the other, and go on along the wall
                self.turn(robot, AVOID_TURN, 0.0)
            if seen_left or seen_right:
                self.until = robot.time + CLEAR_TIME
            elif robot.time >= self.until:
                self.keep_side_until = robot.time + KEEP_SIDE_TIME
                self.state = "straight"

        elif self.state == "back":
            robot.drive(-FORWARD, -FORWARD)
            if robot.time >= self.until:
                self.until = robot.time + ESCAPE_TIME
                self.state = "escape"

        elif self.state == "escape":
            self.turn(robot, TURN, -TURN)
            if robot.time >= self.until:
                self.state = "straight"

    def choose_side(self, robot: Robot, on_left: bool, on_right: bool) -> None:
        """Turn away from where something is; by chance if it is on both sides."""
        if on_left and on_right:
            self.left = robot.chance(0.5)
        else:
            self.left = on_right

    def turn(self, robot: Robot, outer: float, inner: float) -> None:
        """Turn to the chosen side, with these signals for the outer and the inner wheel."""
        if self.left:
            robot.drive(inner, outer)
        else:
            robot.drive(outer, inner)
