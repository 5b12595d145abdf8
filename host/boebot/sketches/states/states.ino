/* states: drives, backs off and turns by a state machine that never waits.
   Robot shieldbot-basic, arena room.

   It does what the sketch whiskers does. But that one waits with delay(), and meanwhile feels nothing. Here each pass of
   loop() looks at everything, and a state ends by what was touched or by the time that it has lasted. */
#include <Servo.h>

const int LEFT_WHISKER = 5, RIGHT_WHISKER = 7;
enum { FORWARD, BACK, TURN };
const char *const NAMES[] = {"forward", "back", "turn"};
Servo left, right;
int state, side;      // side: 1 turns to the right, -1 to the left
unsigned long since;  // ms: when the state began

void enter(int next) {
  if (next != state) Serial.println(NAMES[next]);
  state = next;
  since = millis();
}

// Both wheels at a speed, -200 (full backward) to 200 (full forward).
void drive(int leftSpeed, int rightSpeed) {
  left.writeMicroseconds(1500 + leftSpeed);
  right.writeMicroseconds(1500 - rightSpeed);
}

void setup() {
  Serial.begin(9600);
  left.attach(13);
  right.attach(12);
}

void loop() {
  bool touchesLeft = digitalRead(LEFT_WHISKER) == LOW;
  if (touchesLeft || digitalRead(RIGHT_WHISKER) == LOW) {
    side = touchesLeft ? 1 : -1;
    enter(BACK);
  }
  unsigned long lasted = millis() - since;
  switch (state) {
    case FORWARD:
      drive(200, 200);
      break;
    case BACK:
      drive(-200, -200);
      if (lasted > 600) enter(TURN);
      break;
    case TURN:
      drive(side * 200, -side * 200);
      if (lasted > 500) enter(FORWARD);
      break;
  }
}
