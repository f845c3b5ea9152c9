-- The statements that a worker sends to PostgreSQL in one interval of looking, as recorded by pg_stat_statements
-- (dbos 3.4), for pgbench: :share is the share of intervals in which it ends a job and takes another one, in millionths;
-- :beats that of heartbeats; :pause_us the time between two intervals.
\set draw random(1, 1000000)
SELECT * FROM dbos.queues WHERE name = 'tts2face-segments';
\if :draw <= :share
BEGIN;
SELECT * FROM (SELECT * FROM dbos.application_versions WHERE application_name = 'tts2face' ORDER BY application_name, version_timestamp DESC LIMIT 1) AS own UNION ALL SELECT * FROM (SELECT * FROM dbos.application_versions WHERE application_name IS NULL ORDER BY application_name, version_timestamp DESC LIMIT 1) AS free ORDER BY version_timestamp DESC LIMIT 1;
SELECT coalesce(max(workflow_uuid), '') AS job FROM (SELECT workflow_uuid FROM dbos.workflow_status WHERE queue_name = 'tts2face-segments' AND status = 'ENQUEUED' AND status IN ('ENQUEUED', 'PENDING') AND (application_version = 'segments-1' OR application_version IS NULL) AND (application_name IN ('tts2face') OR application_name IS NULL) ORDER BY priority ASC, created_at ASC LIMIT 1 FOR UPDATE SKIP LOCKED) AS first \gset
UPDATE dbos.workflow_status SET status = 'PENDING', executor_id = 'worker-' || CAST(:client_id AS text), updated_at = EXTRACT(EPOCH FROM now()) * 1000, recovery_attempts = recovery_attempts + 1, started_at_epoch_ms = EXTRACT(EPOCH FROM now()) * 1000, owner_xid = CAST(:job AS text), rate_limited = false, application_name = 'tts2face' WHERE workflow_uuid IN (CAST(:job AS text)) AND status = 'ENQUEUED' RETURNING workflow_uuid;
COMMIT;
SELECT s.*, coalesce(i.inputs, s.inputs) FROM dbos.workflow_status s LEFT OUTER JOIN dbos.workflow_input i ON s.workflow_uuid = i.workflow_uuid WHERE s.workflow_uuid = CAST(:job AS text);
WITH updated AS (UPDATE dbos.workflow_status SET status = 'SUCCESS', updated_at = EXTRACT(EPOCH FROM now()) * 1000, deduplication_id = NULL, owner_xid = NULL, completed_at = EXTRACT(EPOCH FROM now()) * 1000 WHERE workflow_uuid = CAST(:job AS text) AND status = 'PENDING' AND owner_xid = CAST(:job AS text) RETURNING 1), stored AS (INSERT INTO dbos.workflow_output (workflow_uuid, output, error) SELECT CAST(:job AS text), repeat('x', 200), NULL WHERE EXISTS (SELECT 1 FROM updated) ON CONFLICT (workflow_uuid) DO UPDATE SET output = excluded.output RETURNING 1) SELECT count(*) FROM updated;
\endif
\set draw random(1, 1000000)
\if :draw <= :beats
BEGIN;
INSERT INTO tts2face_workers (executor_id, beat, place) VALUES ('worker-' || CAST(:client_id AS text), EXTRACT(EPOCH FROM clock_timestamp()), 'bench') ON CONFLICT (executor_id) DO UPDATE SET beat = EXTRACT(EPOCH FROM clock_timestamp());
SELECT executor_id FROM tts2face_workers WHERE beat <= EXTRACT(EPOCH FROM clock_timestamp()) - 6.0;
COMMIT;
BEGIN;
SELECT workflow_uuid FROM dbos.workflow_status WHERE queue_name = '_dbos_internal_queue' AND status = 'ENQUEUED' AND status IN ('ENQUEUED', 'PENDING') ORDER BY priority ASC, created_at ASC FOR UPDATE SKIP LOCKED;
COMMIT;
SELECT * FROM dbos.queues WHERE application_name IN ('tts2face') OR application_name IS NULL;
SELECT * FROM dbos.workflow_schedules WHERE application_name IN ('tts2face') OR application_name IS NULL;
SELECT pg_try_advisory_xact_lock(1);
\endif
\sleep :pause_us us
