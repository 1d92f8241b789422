# Sourced by both ways to run a command on a real vcan0. MTU 72 is CAN FD.
PATH=$PATH:/usr/sbin:/sbin
ip link set lo up
ip link add dev vcan0 type vcan
ip link set vcan0 mtu 72 up
