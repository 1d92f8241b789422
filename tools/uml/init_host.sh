#!/bin/sh
# First process of a User-Mode Linux that runs on the host's own file system: load the CAN modules, set vcan0 up, run the job, halt.
# The kernel hands EMA_JOB over from its command line: a directory with `command.sh` in, `status` out.
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t tmpfs -o mode=1777 tmpfs /run
mkdir -p /run/tmp /dev/shm
mount -t tmpfs tmpfs /dev/shm
modules=/usr/lib/uml/modules/$(uname -r)/kernel
# vcan fails without can-dev.
for module in net/can/can net/can/can-raw net/can/can-bcm drivers/net/can/dev/can-dev drivers/net/can/vcan net/sched/sch_tbf; do
    busybox insmod $modules/$module.ko
done
. "${0%/*}/vcan_up.sh"
busybox sysctl -q -p "${0%/*}/../../systemd/90-ema-can.conf"
echo EMA-OUTPUT-BEGINS
sh "$EMA_JOB/command.sh" </dev/null
echo $? >"$EMA_JOB/status"
echo EMA-OUTPUT-ENDS
busybox poweroff -f
