/* avoider: looks about with its sonar and goes where there is room.
   Robot rover, arena room.

   Of an H-bridge's channel IN1 and IN2 say which way the motor turns, and the PWM at EN how fast. An HC-SR04 is asked by
   a pulse of 10 us at TRIG; the pulse at ECHO is as long as the sound takes there and back: 58 us for each cm. */
#include <Servo.h>

const int LEFT_MOTOR[] = {5, 7, 8}, RIGHT_MOTOR[] = {6, 11, 9};  // EN; HIGH for forward; HIGH for backward
const int TRIG = A5, ECHO = A4, TURRET = 3;
Servo turret;
int side;  // to which it turns: 1 left, -1 right, 0 not at all

// A motor at a speed, -255 (full backward) to 255 (full forward); 0 brakes.
void run(const int *motor, int speed) {
  digitalWrite(motor[1], speed > 0);
  digitalWrite(motor[2], speed < 0);
  analogWrite(motor[0], speed == 0 ? 255 : abs(speed));
}

// Both motors, for that time (ms).
void drive(int leftSpeed, int rightSpeed, int time) {
  run(LEFT_MOTOR, leftSpeed);
  run(RIGHT_MOTOR, rightSpeed);
  delay(time);
}

// Distance (cm) in that direction (0 right, 90 ahead, 180 left), once the servo is there (ms); 400 if there is no echo.
int look(int angle, int time) {
  turret.write(angle);
  delay(time);
  digitalWrite(TRIG, HIGH);
  delayMicroseconds(10);
  digitalWrite(TRIG, LOW);
  unsigned long echo = pulseIn(ECHO, HIGH, 30000);
  return echo == 0 ? 400 : echo / 58;
}

void setup() {
  for (int pin : LEFT_MOTOR) pinMode(pin, OUTPUT);
  for (int pin : RIGHT_MOTOR) pinMode(pin, OUTPUT);
  pinMode(TRIG, OUTPUT);
  turret.attach(TURRET);
}

void loop() {
  int right = look(40, 300), ahead = look(90, 200), left = look(140, 200);
  if (right > 25 && ahead > 35 && left > 25) {
    side = 0;
    drive(200, 200, 300);
  } else {
    if (side == 0) side = left > right ? 1 : -1;  // and goes on turning that way until there is room
    drive(-200 * side, 200 * side, 160);
  }
  drive(0, 0, 50);
}
