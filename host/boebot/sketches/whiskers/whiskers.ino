/* whiskers: drives on, backs off and turns away from what it touches.
   Robot shieldbot-basic, arena room.

   A whisker is a switch to ground: its pin reads LOW while it touches something. */
#include <Servo.h>

const int LEFT_WHISKER = 5, RIGHT_WHISKER = 7;
Servo left, right;

// Both wheels at a speed, -200 (full backward) to 200 (full forward), for that time (ms).
void drive(int leftSpeed, int rightSpeed, int time) {
  left.writeMicroseconds(1500 + leftSpeed);
  right.writeMicroseconds(1500 - rightSpeed);
  delay(time);
}

void setup() {
  left.attach(13);
  right.attach(12);
}

void loop() {
  bool touchesLeft = digitalRead(LEFT_WHISKER) == LOW;
  bool touchesRight = digitalRead(RIGHT_WHISKER) == LOW;
  if (touchesLeft || touchesRight) drive(-200, -200, 600);  // backward

  if (touchesLeft && touchesRight) drive(-200, 200, 900);  // about
  else if (touchesLeft) drive(200, -200, 500);             // to the right
  else if (touchesRight) drive(-200, 200, 500);            // to the left
  else drive(200, 200, 20);
}
